from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from common.errors import PlanError
from report.budget.limits import DEFAULT, WAITS, from_tables, load


def test_the_shipped_budget_limits_both_directions_and_late_ticks() -> None:
    budget = load(None)
    assert budget.name == "default"
    assert {"command_one_way", "slave_time", "feedback_one_way", "round_trip"} <= budget.segments.keys()
    assert set(budget.segments) <= WAITS.keys()
    assert budget.late.share < 0.02
    for segment in ("command_one_way", "slave_time", "feedback_one_way"):
        assert budget.segments[segment]["p99"] + budget.machine.lateness < 1e-3


def test_a_budget_limits_only_the_figures_that_it_names(tmp_path: Path) -> None:
    path = tmp_path / "b.toml"
    path.write_text('[round_trip]\n"p99.9" = 2e-3\np50 = 1e-3\n')
    budget = load(path)
    assert budget.name == str(path)
    assert budget.segments == {"round_trip": {"p50": 1e-3, "p99.9": 2e-3}}
    assert math.isinf(budget.late.share)
    assert budget.plain()["late"] == {}
    assert budget.machine == load(DEFAULT).machine


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[round_trp]\np99 = 1.0", "Unknown table [round_trp]: did you mean round_trip?"),
        ("p99 = 1.0", "Unknown key 'p99' outside of a table: known here: age_at_use,"),
        ("[round_trip]\np98 = 1.0", "Unknown key 'p98' in [round_trip]: did you mean p99?"),
        ("[round_trip]\nmax = 1.0", "Unknown key 'max' in [round_trip]: known here: p50, p90, p99, p99.9"),
        ("[round_trip]\np99.9 = 1.0", 'p99.9 in [round_trip] must be written in quotes: "p99.9" = 1e-3.'),
        (
            "[round_trip]\np99 = '1'",
            "p99 in [round_trip] must be a number, or one with its unit, not '1'.",
        ),
        ("[round_trip]\np99 = true", "p99 in [round_trip] must be a number, not True."),
        ("[round_trip]\np99 = -1e-3", "p99 in [round_trip] is -0.001, but must be at least 0 s and finite."),
        ("[round_trip]\np99 = nan", "p99 in [round_trip] is nan, but must be at least 0 s and finite."),
        ("round_trip = 3", "[round_trip] must be a table, not 3."),
        ("[late]\nshares = 0.1", "Unknown key 'shares' in [late]: did you mean share?"),
        ("[late]\nshare = 2", "share in [late] is 2.0, but must be at least 0 and at most 1."),
        ("[late]\nlongest_gap = -1", "longest_gap in [late] is -1.0, but must be at least 0 ticks."),
        (
            "[machine]\nstolen_share = 'x'",
            "stolen_share in [machine] must be a number, or one with its unit, not 'x'.",
        ),
        (
            "[machine]\nstolen_share = 0.1",
            "it sets no limit: give one such as p99 = 0.6e-3 in [feedback_one_way].",
        ),
        ("", "it sets no limit"),
        ("[late", "is not valid TOML"),
    ],
)
def test_an_impossible_budget_is_refused_in_one_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "b.toml"
    path.write_text(text)
    with pytest.raises(PlanError) as caught:
        load(path)
    assert sentence in str(caught.value)
    assert str(caught.value).startswith(f"The budget {path}")


def test_an_unreadable_budget_is_refused_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match="Cannot read the budget .*no.toml: No such file"):
        load(tmp_path / "no.toml")
    with pytest.raises(PlanError, match="Cannot read the budget .*: Is a directory"):
        load(tmp_path)
    (tmp_path / "b.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(PlanError, match="not UTF-8"):
        load(tmp_path / "b.toml")


def test_a_limit_of_zero_is_accepted() -> None:
    tables: dict[str, Any] = {"late": {"share": 0, "longest_gap": 0}}
    assert from_tables(tables).late.share == 0.0
