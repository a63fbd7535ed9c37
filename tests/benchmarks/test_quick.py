"""The benchmarks that do not wait for a clock, in their shortest form: each gives figures that fit JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks import BENCHMARKS, live, real_time
from benchmarks.exchange import transports
from benchmarks.result import BenchmarkFigure
from benchmarks.whole_test import Ending, ended_early, ending
from common.plan.tables import SafetyTable

IN_REAL_TIME = {"exchange", "real_time", "live", "start", "recorder"}  # tests/system/test_benchmarks.py
LONG = {"catalogue", "opensees", "scale", "sweep"}  # 3 to 10 s each, most of what all of them take


def plain(figures: list[BenchmarkFigure]) -> list[dict[str, Any]]:
    """The figures as a benchmark writes them; fails where there are none or two share a name."""
    assert figures
    assert len({figure.name for figure in figures}) == len(figures)
    found: list[dict[str, Any]] = json.loads(
        json.dumps([figure._asdict() for figure in figures], allow_nan=False)
    )
    return found


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] if name in LONG else [])
        for name in sorted(BENCHMARKS.keys() - IN_REAL_TIME - {"false_trips"})
    ],
)
def test_a_benchmark_runs_and_gives_figures(name: str) -> None:
    assert any(figure["median"] is not None for figure in plain(BENCHMARKS[name](quick=True)))


def test_false_trips_benchmark_reports_no_violation_and_plausible_gaps() -> None:
    figures = BENCHMARKS["false_trips"](quick=True)
    plain(figures)
    trips, _, *gaps = figures[:4]
    assert trips.points[0]["violations"] == 0
    assert trips.met == (trips.points[0]["trips"] == 0)
    assert all(gap.median is None or 0.0 < gap.median < 0.1 for gap in gaps)


def test_a_test_that_ends_early_counts_as_a_missed_target(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    early = ending(3, "t 0.1\nThe master was held up.\n\n", tmp_path / "none.mcap")
    assert early == Ending(3, "The master was held up.", None)
    (figure,) = plain([ended_early("any", [early])])
    assert (figure["median"], figure["unit"], figure["met"]) == (1.0, "of 1 tests", False)
    assert figure["points"] == [{"exit code": 3, "said": "The master was held up."}]

    monkeypatch.setattr(real_time, "played", lambda *_: early)
    assert [one["met"] for one in plain(real_time.run(quick=True))] == [False, False]
    monkeypatch.setattr(live, "played", lambda *_: live.Turn(early, None))
    assert not any(one["met"] for one in plain(live.run(quick=True)))


def test_the_start_time_in_the_transport_benchmark_is_within_the_slaves_window() -> None:
    plan = transports.bench_plan("rths", Path("any"))
    assert plan.link.connect_timeout > transports.LEAD_S
    assert plan.window * plan.test.interval > transports.LEAD_S > SafetyTable().message_age
