"""pytest plug-in of rths: the fixture `latency_budget`, for the tests of a laboratory's own code.

    def test_latency(latency_budget):
        latency_budget("runs/x.mcap")

`--latency-budget FILE` gives the budget where the call gives none.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from report.budget import BudgetReport

    LatencyBudget = Callable[..., BudgetReport]


def pytest_addoption(parser: pytest.Parser) -> None:
    """The option for the default budget."""
    parser.getgroup("rths").addoption(
        "--latency-budget",
        metavar="FILE",
        help="latency budget (TOML) of the fixture latency_budget where its call gives none",
    )


@pytest.fixture
def latency_budget(pytestconfig: pytest.Config) -> LatencyBudget:
    """Judge a recording: `latency_budget(recording, budget=None)` gives the report of one that is within.

    The test fails with the table if the recording is over its budget, and with a sentence if it cannot be read. It is
    skipped, with the figures, if the machine allows no verdict.
    """

    def call(recording: str | Path, budget: str | Path | None = None) -> BudgetReport:
        return expect(recording, budget if budget is not None else pytestconfig.getoption("latency_budget"))

    return call


def expect(recording: str | Path, budget: str | Path | None) -> BudgetReport:
    """The report of a recording that is within its budget; ends the test otherwise."""
    __tracebackhide__ = True
    from common.errors import RthsError
    from report.budget import assess, text

    report, mistake = None, ""
    try:
        report = assess(recording, budget)
    except RthsError as error:
        mistake = str(error)
    if report is None:  # outside the handler, in which pytest would show the first error too
        pytest.fail(mistake, pytrace=False)
    if report.status == "over":
        pytest.fail(text(report), pytrace=False)
    if report.status == "not_judged":
        pytest.skip(text(report))
    return report
