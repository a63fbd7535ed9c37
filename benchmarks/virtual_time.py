"""How much faster than real time a test in virtual time is: `rths run --virtual` with the plans of rths."""

from __future__ import annotations

import gc
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from benchmarks.result import BenchmarkFigure, rate_figure
from common.plan import read
from common.plan.plan import Plan
from common.plan.read import with_test
from common.plan.tables import RecordingTable
from common.reality import reality
from common.terminal import cli
from simulation import virtual

TARGET = 50_000  # ticks per second without a recorder: 100 times real time at 500 ticks per second
# times real time with a recorder: the default test of 40 s in less than 2 s; by processor time, because the machine is
# shared
TARGET_FACTOR = 25
REPEATS, OTHERS = (
    7,
    3,
)  # of the default test and of the other plans; odd, so that the median is a measured value
OTHERS_S, QUICK_S = 10.0, 0.2  # duration of the other plans' tests, and of all with `quick`


class Pace(NamedTuple):
    """The speed of a test: ticks per second of wall time, and of processor time."""

    wall: float
    processor: float


def played(plan: Plan, output: Callable[[], Path | None], repeats: int) -> list[Pace]:
    """The speeds of several runs of a test, without building and warming up."""
    found = []
    for _ in range(repeats):
        bench = virtual.assemble(plan, reality.as_planned(plan), output())
        gc.collect()
        gc.disable()
        wall, processor = time.perf_counter(), time.process_time()
        error = virtual.run(bench, str)
        wall, processor = time.perf_counter() - wall, time.process_time() - processor
        found.append(Pace(bench.master.ticks / wall, bench.master.ticks / processor))
        gc.enable()
        if error is not None:
            raise error
    return found


def unrecorded(plan: Plan, repeats: int) -> list[Pace]:
    """The speeds of tests without a recorder."""
    return played(replace(plan, recording=RecordingTable(required=False)), lambda: None, repeats)


def factors(plan: Plan, repeats: int) -> list[Pace]:
    """The speeds of recorded tests over real time."""
    with tempfile.TemporaryDirectory() as folder:
        found = played(plan, lambda: Path(folder) / "a.mcap", repeats)
    interval = plan.test.interval
    return [Pace(pace.wall * interval, pace.processor * interval) for pace in found]


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """The default test without and with a recorder, then the other plans of rths with a recorder."""
    plan, repeats = (with_test(Plan(), duration=QUICK_S), 1) if quick else (Plan(), REPEATS)
    alone = [pace.wall for pace in unrecorded(plan, repeats)]
    found = factors(plan, repeats)
    figures = [
        rate_figure("virtual time, without recorder", "ticks/s", alone, least=TARGET),
        rate_figure(
            "virtual time, default, by the processor's time",
            "× real time",
            [pace.processor for pace in found],
            least=TARGET_FACTOR,
        ),
        rate_figure(
            "virtual time, default, by the wall's clock", "× real time", [pace.wall for pace in found]
        ),
    ]
    for name in sorted({*cli.SHIPPED} - {"default"}):
        other = with_test(read.load(cli.plan_path(name)), duration=QUICK_S if quick else OTHERS_S)
        paces = [pace.processor for pace in factors(other, 1 if quick else OTHERS)]
        figures.append(rate_figure(f"virtual time, {name}, by the processor's time", "× real time", paces))
    return figures
