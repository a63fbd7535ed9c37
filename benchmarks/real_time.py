"""Round trip and late ticks of whole tests in real time, alone and beside busy processes.

The late ticks are compared with those of a bare timing loop that runs beside the test.
"""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.load import BUSY, busy
from benchmarks.result import BenchmarkFigure, cost_figure
from benchmarks.whole_test import ended_early, played
from common.recording.run import MACHINES, Run

SECONDS, QUICK_S = 20.0, 0.5  # duration of a test
REPEATS = 3  # odd, so that the median is a measured value
MOST_LATE = 0.05  # percentage points above the bare timing loop: 5 of the 10,000 ticks of a test
MOST_LOADED = 500.0  # µs, p99 of the round trip beside busy processes: a quarter of the interval of 2 ms


class Facts(NamedTuple):
    """The figures of one test."""

    priority: float  # real-time priority of the master, 0 without one
    round_trip: tuple[float, float]  # p50 and p99, µs
    late: float  # %
    late_beside: float  # of the bare timing loop, %


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """Run the first seconds of the default test several times."""
    seconds, repeats = (QUICK_S, 1) if quick else (SECONDS, REPEATS)
    return [
        *several("rths run", seconds, repeats, None, loaded=False),
        *several(f"rths run beside {BUSY} busy processes", seconds, repeats, MOST_LOADED, loaded=True),
    ]


def several(
    name: str, seconds: float, repeats: int, most: float | None, *, loaded: bool
) -> list[BenchmarkFigure]:
    """Run several equal tests; those that end early are counted and not used for the other figures."""
    endings = []
    with tempfile.TemporaryDirectory() as folder, busy() if loaded else contextlib.nullcontext():
        for number in range(repeats):
            endings.append(played(Path(folder) / f"{number}.mcap", "--duration", str(seconds)))
    tests = [found(ending.run) for ending in endings if ending.completed and ending.run is not None]
    return [ended_early(name, endings), *(figures(name, tests, most) if tests else [])]


def found(run: Run) -> Facts:
    """The figures of a recording."""
    latency, machines = run.columns["latency"], run.metadata[MACHINES]
    trips = latency["round_trip"][np.isfinite(latency["round_trip"])] * 1e6
    beside = {name: float(machines[f"bare_loop.{name}"]) for name in ("ticks", "late")}
    return Facts(
        float(machines["master.priority"]),
        (float(np.percentile(trips, 50)), float(np.percentile(trips, 99))),
        100.0 * float(np.mean(latency["deadline_missed"])),
        100.0 * beside["late"] / (beside["ticks"] + beside["late"]),
    )


def figures(name: str, tests: list[Facts], most: float | None) -> list[BenchmarkFigure]:
    """Round trip and late ticks of several equal tests; the targets apply to tests with real-time priority."""
    judged = all(test.priority > 0 for test in tests)
    middle, tail = ([test.round_trip[place] for test in tests] for place in (0, 1))
    beyond = [test.late - test.late_beside for test in tests]
    p99 = cost_figure(f"{name}, round trip, p99", "µs", tail, most=most)
    late = cost_figure(f"{name}, late ticks beyond a bare timing loop's", "points", beyond, most=MOST_LATE)
    return [
        cost_figure(f"{name}, round trip, p50", "µs", middle),
        *(figure if judged else figure._replace(met=None) for figure in (p99, late)),
    ]
