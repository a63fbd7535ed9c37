"""Benchmarks: figures with their peers in the same run.

Each takes `quick`: the same work in the least time, which shows that it runs; its figures then say little.
"""

from __future__ import annotations

from typing import Protocol

from benchmarks import (
    closed_loop,
    codec,
    exchange,
    false_trips,
    live,
    real_time,
    recorder,
    scale,
    start,
    udp_rig,
    virtual_time,
)
from benchmarks.result import BenchmarkFigure


class Benchmark(Protocol):
    """One benchmark."""

    def __call__(self, *, quick: bool = False) -> list[BenchmarkFigure]:
        """Its figures."""


BENCHMARKS: dict[str, Benchmark] = {
    "exchange": exchange.run,
    "real_time": real_time.run,
    "live": live.run,
    "closed_loop": closed_loop.run,
    "virtual": virtual_time.run,
    "scale": scale.run,
    "recorder": recorder.run,
    "codec": codec.run,
    "udp_rig": udp_rig.run,
    "start": start.run,
    "false_trips": false_trips.run,
}
