"""Tests per second of a sweep for a fragility curve, with one process and with two."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.result import BenchmarkFigure
from simulation.sweep import definition
from simulation.sweep.definition import Sweep
from simulation.sweep.table import table
from simulation.workers.parts import Way

ASKED = 50_000  # tests of 40 s
LONGEST = 300.0  # s for them, with two processes
GAIN = 1.8  # of two processes over one
QUICK_TESTS = 64  # measured instead, quickly; the start of the processes then takes most of the time


def asked(tests: int) -> Sweep:
    """The default test under its motion at fifty scales, with damping, stiffness and specimen drawn."""
    scales = max(2, min(50, tests // 64))
    return definition.from_tables(
        {
            "draws": tests // scales,
            "motion": [{"scales": {"from": 0.05, "to": 1.0, "count": scales}}],
            "drawn": {
                "structure.damping": {"dispersion": 0.4},
                "structure.stiffness": {"dispersion": 0.1},
                "column.stiffness": {"dispersion": 0.02},
            },
            "intensity": {"period": 0.5},
        },
        Path(),
    )


def measured(sweep: Sweep, jobs: int) -> float:
    """Seconds from the call until the table is written, with the start of the processes."""
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        table(Path(folder) / "sweep.parquet", sweep, Way(jobs))
        return time.perf_counter() - began


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """The time of the tests that were asked for, and the gain of a second process; quickly, from a few tests."""
    measured(asked(QUICK_TESTS), 1)  # loads the kernels
    sweep = asked(QUICK_TESTS if quick else ASKED)
    one, two = (measured(sweep, jobs) for jobs in (1, 2))
    times = [
        {"processes": jobs, "tests per second": sweep.rows / spent} for jobs, spent in ((1, one), (2, two))
    ]
    return [
        whole(f"{ASKED:,} tests of a sweep, two processes", two * ASKED / sweep.rows, times),
        BenchmarkFigure(
            "gain of the second process", "×", one / two, one / two, f"≥ {GAIN:g}", one >= GAIN * two
        ),
    ]


def whole(name: str, seconds: float, points: list[dict[str, Any]]) -> BenchmarkFigure:
    """The figure of a time with a target."""
    met = seconds <= LONGEST
    return BenchmarkFigure(name, "s", seconds, seconds, f"≤ {LONGEST:g}", met, points=points)
