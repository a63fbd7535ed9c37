"""Which averages of a building's balance its verdict is of."""

from __future__ import annotations

from typing import Any, cast

import pytest

from diagnosis.findings.logged import building
from diagnosis.findings.logged.building import by_balance
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits import fitting
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import Search
from tests.diagnosis.cases import Cases
from tests.diagnosis.test_logged import logged


@pytest.mark.parametrize(
    ("longer", "shorter", "group"),
    [
        ("none", "unknown", 5),
        ("explained", "unknown", 5),
        ("explained", "partly", 5),
        ("explained", "explained", 1),
        ("partly", "unknown", 1),
    ],
)
def test_what_longer_averages_explain_counts_where_shorter_ones_have_no_cause(
    cases: Cases, monkeypatch: pytest.MonkeyPatch, longer: str, shorter: str, group: int
) -> None:
    view = logged(record := cases.record())
    bare = fitting.fit(view, {})
    monkeypatch.setattr(building, "search", lambda data, _: Search(data, bare, bare, ()))

    def judged(found: Search) -> PartVerdict:
        outcome = longer if found.data.group > view.group else shorter
        return PartVerdict(found, cast(Any, outcome), 1.0, (), ())

    monkeypatch.setattr(building, "judge", judged)
    assert by_balance(view, Scales(record)).search.data.group == group * view.group
