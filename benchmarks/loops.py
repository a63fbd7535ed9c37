"""Ticks per second of a test in virtual time, with and without recorder."""

from __future__ import annotations

import gc
import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from benchmarks.result import BenchmarkFigure, rate_figure
from common.plan import reality
from common.plan.plan import Plan
from common.plan.read import with_test
from common.plan.tables import RecordingTable
from simulation import virtual

TARGET = 50_000
TARGET_RECORDED = 12_500  # 25 times real time at the default interval of 2 ms
REPEATS = 7
QUICK_S = 1.0  # of the test


def played(plan: Plan, output: Callable[[], Path | None], repeats: int) -> list[float]:
    """Ticks per second of several tests; building and warming up are not counted."""
    found = []
    for _ in range(repeats):
        bench = virtual.assemble(plan, reality.as_planned(plan), output())
        gc.collect()
        gc.disable()
        began = time.perf_counter()
        error = virtual.run(bench, str)
        found.append(bench.master.ticks / (time.perf_counter() - began))
        gc.enable()
        if error is not None:
            raise error
    return found


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """The default test, its drive and loops over the link in memory."""
    plan, repeats = (with_test(Plan(), duration=QUICK_S), 1) if quick else (Plan(), REPEATS)
    alone = played(replace(plan, recording=RecordingTable(required=False)), lambda: None, repeats)
    with tempfile.TemporaryDirectory() as folder:
        recorded = played(plan, lambda: Path(folder) / "a.mcap", repeats)
    return [
        rate_figure("loops in virtual time", "ticks/s", alone, least=TARGET),
        rate_figure(
            "loops in virtual time, recorded",
            "ticks/s",
            recorded,
            least=TARGET_RECORDED,
            peer="without recorder",
            beside=statistics.median(alone),
        ),
    ]
