"""Benchmarks: figures with their peers in the same run; never part of the tests."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks import (
    closed_loop,
    codec,
    exchange,
    false_trips,
    live,
    loops,
    real_time,
    recorder,
    scale,
    start,
)
from benchmarks.result import Figure

BENCHMARKS: dict[str, Callable[[], list[Figure]]] = {
    "exchange": exchange.run,
    "real_time": real_time.run,
    "live": live.run,
    "closed_loop": closed_loop.run,
    "loops": loops.run,
    "scale": scale.run,
    "recorder": recorder.run,
    "codec": codec.run,
    "start": start.run,
    "false_trips": false_trips.run,
}
