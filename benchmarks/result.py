"""What a benchmark gives: figures with their peers and targets."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple


class BenchmarkFigure(NamedTuple):
    """One figure; `best` and `median` of several repeats, in `unit`; `peer` names what stands beside it."""

    name: str
    unit: str
    best: float | None  # None where it could not be had here; the name says why
    median: float | None
    target: str = ""
    met: bool | None = None
    peer: str = ""
    ratio: float | None = None  # this figure over the peer's, medians
    points: Sequence[Mapping[str, Any]] = ()  # of a curve, in the order of its values


def rates(
    work: Callable[[], int], repeats: int, clock: Callable[[], float] = time.perf_counter
) -> list[float]:
    """Items per second of each repeat; `work` does some and says how many. The first run is not counted.

    `clock` (s) is the wall's; `time.process_time` leaves out what other processes take of the machine.
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
    """Figure of a rate; `least` is its target, judged by the best repeat, since the machine is shared."""
    best, median = max(found), statistics.median(found)
    met = None if least is None else best >= least
    target = "" if least is None else f"≥ {least:,.0f}"
    return BenchmarkFigure(name, unit, best, median, target, met, peer, median / beside if beside else None)


def cost_figure(name: str, unit: str, found: list[float], *, most: float | None = None) -> BenchmarkFigure:
    """Figure of a cost; `most` is its target, judged by the median."""
    best, median = min(found), statistics.median(found)
    met = None if most is None else median <= most
    return BenchmarkFigure(name, unit, best, median, "" if most is None else f"≤ {most:g}", met)
