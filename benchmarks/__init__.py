"""Benchmarks: figures with their peers in the same run; never part of the tests."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks import closed_loop, codec, loops, recorder, start
from benchmarks.result import Figure

BENCHMARKS: dict[str, Callable[[], list[Figure]]] = {
    "closed_loop": closed_loop.run,
    "loops": loops.run,
    "codec": codec.run,
    "recorder": recorder.run,
    "start": start.run,
}
