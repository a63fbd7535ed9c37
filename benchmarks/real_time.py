"""Whole tests in real time, alone and beside busy processes: round trip, and late ticks beside a bare timing loop's."""

from __future__ import annotations

import contextlib
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.load import BUSY, busy
from benchmarks.result import Figure
from common.recording.reader import MACHINES, Run, read

ROOT = Path(__file__).resolve().parent.parent
SECONDS = 20.0
REPEATS = 3
MOST_LATE = 0.05  # percentage points beyond the bare timing loop
MOST_LOADED = 500.0  # µs, p99 of the round trip beside busy processes, with real-time priority


class Facts(NamedTuple):
    """What one test gave."""

    priority: float
    round_trip: tuple[float, float]  # p50 and p99, µs
    late: float  # %
    late_beside: float  # %, of the bare timing loop


def run() -> list[Figure]:
    """The default test's first seconds, several times."""
    quiet = [facts(loaded=False) for _ in range(REPEATS)]
    loaded = [facts(loaded=True) for _ in range(REPEATS)]
    return [
        *figures("rths run", quiet, None),
        *figures(f"rths run beside {BUSY} busy processes", loaded, MOST_LOADED),
    ]


def facts(*, loaded: bool) -> Facts:
    """One test."""
    with tempfile.TemporaryDirectory() as folder, busy() if loaded else contextlib.nullcontext():
        path = Path(folder) / "a.mcap"
        words = [sys.executable, "-m", "rths", "run", "--duration", str(SECONDS), "-o", str(path)]
        subprocess.run(words, cwd=ROOT, check=True, capture_output=True)
        return found(read(path))


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


def figures(name: str, tests: list[Facts], most: float | None) -> list[Figure]:
    """Round trip and late ticks of several tests alike."""
    judged = all(test.priority > 0 for test in tests)
    middle, tail = ([test.round_trip[place] for test in tests] for place in (0, 1))
    beyond = statistics.median(test.late - test.late_beside for test in tests)
    p99 = statistics.median(tail)
    met = None if most is None or not judged else p99 <= most
    target = "" if most is None else f"≤ {most:g}"
    return [
        Figure(f"{name}, round trip, p50", "µs", min(middle), statistics.median(middle)),
        Figure(f"{name}, round trip, p99", "µs", min(tail), p99, target, met),
        Figure(
            f"{name}, late ticks beyond a bare timing loop's",
            "points",
            min(test.late - test.late_beside for test in tests),
            beyond,
            f"≤ {MOST_LATE}",
            beyond <= MOST_LATE if judged else None,
        ),
    ]
