"""The ticks of a controller by the clock of a logger with slower rows, from motions that the controller computed.

Each row shows what was computed at the last tick before it, up to an interval earlier. Put at the right ticks such a
motion is as smooth as it was; put at others it jumps back and forth by what it moves in an interval.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from models.registry import Array
from rths.examine.importing.controller_clock import ControllerClock

SLOWER = 0.97  # rows in an interval, below which they pass over ticks
FASTEST = 1e-4  # by which clocks differ at most
BEGUN = 20.0  # s, of the beginning by which a clock is found roughly
# Of an interval, by which clocks are tried that begin, and are later at the end, closer and closer.
STEPS = (0.1, 0.03, 0.01, 0.003)
REACH = 5  # such steps to each side
SURELY = 0.2  # of what the worst clock leaves, below which one is found
FEWEST = 200  # rows
NEAR = 0.3  # of an interval, within which clocks put most rows at the same ticks
TYPICAL = 1.6  # of the usual distance of four neighbours, up to which these tell what is between them


class Fitted(NamedTuple):
    """A clock with what it leaves of a motion over what the worst one leaves."""

    clock: ControllerClock
    share: float


def clock_by_smoothness(times: Array, channels: Iterable[Array], interval: float) -> ControllerClock | None:
    """The clock by numbers of a controller (n,) at times (n,) of a logger, s; None where none of them tells it."""
    if times.size < FEWEST or interval > SLOWER * float(np.median(np.diff(times))):
        return None
    found = [best(times, values, interval) for values in channels if np.ptp(values) > 0.0]
    sure = [one for one in found if one.share < SURELY]
    return min(sure, key=lambda one: one.share).clock if sure else None


def best(times: Array, values: Array, interval: float) -> Fitted:
    """The clock by which a motion (n,) is smoothest."""
    lasts = min(BEGUN, float(times[-1]))
    begins, rates = STEPS[0] * np.arange(-REACH, REACH + 1.0), STEPS[0] * interval / lasts
    fasts = rates * np.arange(-np.ceil(FASTEST / rates), np.ceil(FASTEST / rates) + 1.0)
    clock, most, least = ControllerClock(interval, 0.0, 0.0), 0.0, np.inf
    for step in STEPS:
        there = times <= lasts
        clocks = [
            ControllerClock(interval, clock.begin + interval * begin, clock.fast + fast)
            for begin in begins
            for fast in fasts
        ]
        left = np.array([missed(one, times[there], values[there]) for one in clocks])
        most, least = most or float(left.max()), float(left.min())
        clock = middle([one for one, over in zip(clocks, left, strict=True) if over <= 1.001 * least], lasts)
        lasts = float(times[-1])
        begins = step * np.linspace(-1.0, 1.0, 2 * REACH + 1)
        fasts = begins * interval / lasts
    return Fitted(clock, least / max(most, 1e-300))


def middle(alike: Sequence[ControllerClock], lasts: float) -> ControllerClock:
    """The middle of clocks that leave as little over some s, of those near the first one from the first row on.

    Others put every row at the next tick, which is as smooth.
    """
    first = min(alike, key=lambda one: abs(one.begin) + lasts * abs(one.fast))
    near = [
        one
        for one in alike
        if max(abs(one.begin - first.begin), lasts * abs(one.fast - first.fast)) <= NEAR * first.interval
    ]
    begin, fast = (float(np.mean([one[place] for one in near])) for place in (1, 2))
    return ControllerClock(first.interval, begin, fast)


def missed(clock: ControllerClock, times: Array, values: Array) -> float:
    """Mean of what cubics through four neighbours miss a motion (n,) by, at the ticks that a clock gives its rows."""
    ticks = np.floor(clock.places(times))
    apart = [ticks[2 + by : ticks.size - 2 + by] - ticks[2:-2] for by in (-2, -1, 1, 2)]
    known = np.zeros(ticks.size - 4)
    for own, by in zip(apart, (-2, -1, 1, 2), strict=True):
        weight = np.ones_like(known)
        for other in apart:
            if other is not own:
                weight *= other / np.where(other == own, np.inf, other - own)
        known += weight * values[2 + by : ticks.size - 2 + by]
    spread = apart[3] - apart[0]
    usual = spread < TYPICAL * np.median(spread)
    return float(np.mean(np.abs(values[2:-2] - known)[usual]))
