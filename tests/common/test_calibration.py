"""The tables of a plan for the report and for the calibration of sensors."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import pytest

from common.errors import PlanError
from common.lab.preflight import Gate, calibration_checks
from common.plan.calibration import Calibration, calibrations, overdue
from common.plan.plan import Plan
from common.plan.plan_difference import changed
from common.plan.read import parse

TEXT = """
[report]
laboratory = "Laboratory 4"
[report.calibration.column_force]
date = 2025-05-01
due = "2026-05-01"
by = "an institute"
certificate = "F-2231"
[report.calibration.table_acceleration]
date = 2026-05-01
"""


def test_the_report_table_does_not_change_the_test_or_its_digest() -> None:
    plan = parse(TEXT, Path())
    assert plan.digest() == parse("", Path()).digest()
    assert changed(plan) == changed(Plan())
    assert parse(plan.toml(), Path()) == plan
    assert "[report]" not in Plan().toml()


def test_calibrations_of_sensors_are_read_with_their_dates() -> None:
    force, acceleration = calibrations(parse(TEXT, Path()))
    assert force == Calibration("column_force", date(2025, 5, 1), date(2026, 5, 1), "an institute", "F-2231")
    assert acceleration == Calibration("table_acceleration", date(2026, 5, 1))


@pytest.mark.parametrize(("day", "warned"), [(date(2026, 5, 1), []), (date(2026, 5, 2), ["column_force"])])
def test_a_calibration_holds_through_the_day_on_which_it_is_due(day: date, warned: list[str]) -> None:
    plan = parse(TEXT, Path())
    said = list(overdue(plan, day))
    assert said == [f"the calibration of {name} was due on 2026-05-01" for name in warned]
    gate = Gate()
    gate.judge(calibration_checks(plan, day))
    assert [(text, level) for _, text, level in gate.passed] == [
        (f"pre-flight: {text}.", "warning") for text in said
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[report.calibration.x]", r"\[report.calibration.x\] gives no date: give `date`, `due`, or both."),
        ("[report.calibration.x]\ndate = 3", "must be a date such as 2026-05-01, not 3."),
        ('[report.calibration.x]\ndue = "soon"', "must be a date such as 2026-05-01, not 'soon'."),
        ("[report.calibration.x]\ndate = 2026-05-01\nby = 4", "must be a text in quotes, not 4."),
        ("[report.calibration.x]\ndat = 2026-05-01", "Unknown key 'dat' in .*: did you mean date?"),
        ("[report.calibration]\nx = 4", "must be a table with date and due, not 4."),
    ],
)
def test_a_wrong_calibration_is_refused_in_one_sentence(text: str, said: str) -> None:
    with pytest.raises(PlanError, match=said):
        parse(text, Path())
