"""Benchmarks: each measures figures of rths, and comparable programs in the same run.

With `quick` a benchmark does the least work that shows that it runs; its figures are then not representative.
"""

from __future__ import annotations

from typing import Protocol

from benchmarks import (
    catalogue,
    closed_loop,
    codec,
    exchange,
    false_trips,
    live,
    opensees,
    real_time,
    recorder,
    scale,
    start,
    sweep,
    udp_rig,
    virtual_time,
)
from benchmarks.result import BenchmarkFigure


class Benchmark(Protocol):
    """A benchmark: a function that measures figures."""

    def __call__(self, *, quick: bool = False) -> list[BenchmarkFigure]:
        """Measure and return the figures."""


BENCHMARKS: dict[str, Benchmark] = {
    "exchange": exchange.run,
    "real_time": real_time.run,
    "live": live.run,
    "catalogue": catalogue.run,
    "closed_loop": closed_loop.run,
    "virtual": virtual_time.run,
    "scale": scale.run,
    "sweep": sweep.run,
    "recorder": recorder.run,
    "codec": codec.run,
    "udp_rig": udp_rig.run,
    "opensees": opensees.run,
    "start": start.run,
    "false_trips": false_trips.run,
}
