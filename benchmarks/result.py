"""The figures of a benchmark, with targets and with the figures of comparable programs (peers)."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple


class BenchmarkFigure(NamedTuple):
    """One figure: `best` and `median` of several repeats in `unit`; `peer` names what it is compared with."""

    name: str
    unit: str
    best: float | None  # None if it cannot be measured on this machine; the name says why
    median: float | None
    target: str = ""
    met: bool | None = None
    peer: str = ""
    ratio: float | None = None  # this figure over the peer's, medians
    points: Sequence[Mapping[str, Any]] = ()  # of a curve, in the order of its values


def rates(
    work: Callable[[], int], repeats: int, clock: Callable[[], float] = time.perf_counter
) -> list[float]:
    """Items per second of each repeat; `work` returns the number of items it did. A first run is not counted.

    `clock` returns s: wall time, or with `time.process_time` the processor time, which other processes affect less.
    """
    work()
    found = []
    for _ in range(repeats):
        began = clock()
        items = work()
        found.append(items / (clock() - began))
    return found


def rate_figure(
    name: str,
    unit: str,
    found: list[float],
    *,
    least: float | None = None,
    peer: str = "",
    beside: float = 0.0,
) -> BenchmarkFigure:
    """The figure of a rate; its target `least` is judged by the best repeat, because the machine is shared."""
    best, median = max(found), statistics.median(found)
    met = None if least is None else best >= least
    target = "" if least is None else f"≥ {least:,.0f}"
    return BenchmarkFigure(name, unit, best, median, target, met, peer, median / beside if beside else None)


def cost_figure(name: str, unit: str, found: list[float], *, most: float | None = None) -> BenchmarkFigure:
    """The figure of a cost; its target `most` is judged by the median."""
    best, median = min(found), statistics.median(found)
    met = None if most is None else median <= most
    return BenchmarkFigure(name, unit, best, median, "" if most is None else f"≤ {most:g}", met)
