"""Only ticks up to the end of a test can be missing."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan.plan import Plan
from common.plan.read import with_test
from common.recording.run import Run
from common.safety.modes import Mode
from report.facts.due import due
from report.run.verdict import completeness
from rths.examine.inspect import stopped

PLAN = with_test(Plan(), duration=0.02)  # ten ticks


def turn(lab: str, tick: int, before: Mode, after: Mode) -> dict[str, Any]:
    """The event of a change of a laboratory's mode."""
    modes = list(Mode)
    values = {"from": float(modes.index(before)), "mode": float(modes.index(after))}
    return {"t": tick * PLAN.test.interval, "lab": lab, "code": "mode", "values": values}


def recorded(rows: Mapping[str, int], *events: dict[str, Any], cause: str = "a limit") -> Run:
    """A recording with the first rows of each topic."""
    return Run(
        Path("made.mcap"),
        columns={topic: {"t": np.arange(count) * 0.002} for topic, count in rows.items()},
        sequences={topic: np.arange(count) for topic, count in rows.items()},
        events=[turn("master", 0, Mode.ARMED, Mode.RUNNING), *events],
        metadata={"summary": {"cause": cause}} if cause else {},
    )


STOPPED = (turn("master", 6, Mode.RUNNING, Mode.RAMPING), turn("slave", 6, Mode.HOLDING, Mode.RAMPING))


@pytest.mark.parametrize(
    ("run", "expected"),
    [
        (recorded({"master": 10, "slave": 9}, cause="completed"), {"master": 10, "slave": 10}),
        (
            recorded({"master": 7, "slave": 6, "latency": 7}, *STOPPED),
            {"master": 7, "slave": 6, "latency": 7},
        ),
        (recorded({"master": 6, "slave": 3}, *STOPPED), {"master": 6, "slave": 6}),  # rows lost
        (recorded({"master": 6, "slave": 3}, STOPPED[0]), {"master": 6, "slave": 6}),  # a slave killed
        (recorded({"master": 4, "slave": 5}, cause=""), {"master": 5, "slave": 5}),  # the recorder killed
        (recorded({"master": 0, "slave": 0}), {"master": 0, "slave": 0}),
        (recorded({"master": 99}, cause=""), {"master": 10}),
    ],
)
def test_only_ticks_up_to_the_end_of_a_test_are_expected(run: Run, expected: dict[str, int]) -> None:
    assert due(run, PLAN) == expected


def test_without_a_plan_the_recorded_ticks_are_expected() -> None:
    assert due(recorded({"master": 4, "slave": 5}), None) == {"master": 4, "slave": 5}


def test_the_verdict_states_where_a_test_stopped_and_what_is_missing_until_then() -> None:
    facts = {"master": {"missing": 0}, "slave": {"missing": 204}}
    summary = {
        "ticks_planned": 7000,
        "ticks_expected": 330,
        "topics": facts,
        "recorder": {"cause": "a limit"},
    }
    text = "The test stopped at tick 330 of 7000; until then the slave lacks 204."
    assert completeness(summary) == text
    assert stopped(summary) == "stopped at tick 330 of 7000"


def test_for_a_recording_that_was_cut_off_the_verdict_does_not_state_the_end_of_the_test() -> None:
    facts = {"master": {"missing": 0}}
    summary = {"ticks_planned": 7000, "ticks_expected": 330, "topics": facts, "recorder": {}}
    assert stopped(summary) == "recorded until tick 330 of 7000; the rest of the test is not in the file"
    assert completeness(summary).startswith(
        "The recording ends at tick 330 of 7000; all ticks until then are recorded"
    )


def test_a_run_that_a_limit_stops_counts_the_ticks_until_then(call: Any, capsys: Any, tmp_path: Path) -> None:
    plan = tmp_path / "trip.toml"
    plan.write_text("[limits]\ncolumn_displacement = 1e-4\n[preflight]\npeak_share = 1e3\n")
    words = ["run", str(plan), "--virtual", "--duration", "4", "-o", str(tmp_path / "trip.mcap")]
    assert call(*words) == 3
    out, err = capsys.readouterr()
    rows = re.findall(r"^(?:master|slave|latency) +(\d+) +(\d+) +(\d+) +none$", out, re.MULTILINE)
    ticks = max(int(expected) for expected, _, _ in rows)
    assert [(expected, "0") for expected, _, _ in rows] == [(found, missing) for _, found, missing in rows]
    assert f"stopped at tick {ticks} of 2000\n" in out
    assert f"{ticks * 0.002:g} s of test in " in err
