"""The ticks of a controller by the clock of a logger with slower rows, from motions that the controller computed.

Each row shows what was computed at the last tick before it, up to an interval earlier. Put at the right ticks such a
motion is as smooth as it was; put at others it jumps back and forth by what it moves in an interval.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from models.registry import Array
from rths.examine.importing.ticks import ControllerClock

SLOWER = 0.97  # rows in an interval, below which they pass over ticks
FASTEST = 1e-4  # by which clocks differ at most
BEGUN = 20.0  # s, of the beginning by which a clock is found roughly, or more for rows that are few
MOST_DOUBLED = 16  # times that this beginning is made twice as long
# Of an interval, by which clocks are tried that begin elsewhere or are elsewhere at the end, closer and closer, and how
# many such steps to each side.
FINER, REACH = (0.1, 0.03, 0.01, 0.003), 6
ALIKE = 1.01  # of what the best clock leaves, up to which another one is as good
# Of an interval, within which clocks put most rows at the same ticks, and rounds in which the middle of these is found.
NEAR, ROUNDS = 0.5, 5
SURELY = 0.05  # of what the worst clock of its rate leaves, below which one is found
FEWEST = 200  # rows
SIDE = 3  # neighbours to each side of a row
NEIGHBOURS = [by for by in range(-SIDE, SIDE + 1) if by]
TYPICAL = 1.6  # of the usual distance of these, up to which they tell what is between them


class Fitted(NamedTuple):
    """A clock with what it leaves of a motion over what the worst one of its rate leaves."""

    clock: ControllerClock
    share: float


def clock_by_smoothness(times: Array, channels: Iterable[Array], interval: float) -> ControllerClock | None:
    """The clock by numbers of a controller (n,) at times (n,) of a logger, s; None where none of them tells it."""
    if times.size < FEWEST or interval > SLOWER * float(np.median(np.diff(times))):
        return None
    begun = times <= beginning(times)
    moving = [values for values in channels if np.ptp(values[begun]) > 0.0]
    if not moving:
        return None
    smoothest = min(moving, key=lambda values: best(times[begun], values[begun], interval).share)
    found = best(times, smoothest, interval)
    return found.clock if found.share < SURELY else None


def beginning(times: Array) -> float:
    """The time (s) up to which a clock is found roughly, of times (n,)."""
    return max(BEGUN, float(times[FEWEST - 1]))


def best(times: Array, values: Array, interval: float) -> Fitted:
    """The clock by which a motion (n,) is smoothest: by its beginning first, by more and more, and then closer."""
    whole, begun = float(times[-1]), beginning(times)
    lengths = [begun * 2.0**power for power in range(MOST_DOUBLED) if begun * 2.0**power < whole]
    looks = [*((lasts, FINER[0]) for lasts in lengths), *((whole, step) for step in FINER)]
    clock, most, least = ControllerClock(interval, 0.0, 0.0), 0.0, 0.0
    for lasts, step in looks:
        there = times <= lasts
        late = REACH if most else int(np.ceil(FASTEST * lasts / (step * interval)))
        clocks = [
            ControllerClock(interval, clock.begin + interval * begin, clock.fast + interval * end / lasts)
            for begin, end in itertools.product(around(REACH, step), around(late, step))
        ]
        left = [missed(one, times[there], values[there]) for one in clocks]
        least = min(left)
        same = clocks[left.index(least)].fast
        most = most or max(over for one, over in zip(clocks, left, strict=True) if one.fast == same)
        near = [one for one, over in zip(clocks, left, strict=True) if over <= ALIKE * least]
        clock = middle(near, lasts)
    return Fitted(clock, least / max(most, 1e-300))


def around(steps: int, step: float) -> list[float]:
    """Parts of an interval to either side of none."""
    return [step * place for place in range(-steps, steps + 1)]


def middle(alike: Sequence[ControllerClock], lasts: float) -> ControllerClock:
    """The middle of clocks that leave as little over some s, those aside that put every row at another tick."""
    interval = alike[0].interval
    where = np.array([(one.begin, lasts * one.fast) for one in alike]) / interval
    centre = where[np.argmin(np.abs(where).sum(axis=1))]
    for _ in range(ROUNDS):
        centre = where[np.abs(where - centre).max(axis=1) <= NEAR].mean(axis=0)
    return ControllerClock(interval, float(centre[0]) * interval, float(centre[1]) * interval / lasts)


def missed(clock: ControllerClock, times: Array, values: Array) -> float:
    """Mean of what polynomials through neighbours miss a motion (n,) by, at the ticks that a clock gives its rows."""
    ticks = np.floor(clock.places(times))
    inner = slice(SIDE, ticks.size - SIDE)
    apart = {by: ticks[SIDE + by : ticks.size - SIDE + by] - ticks[inner] for by in NEIGHBOURS}
    known = np.zeros(ticks.size - 2 * SIDE)
    for by, own in apart.items():
        weight = np.ones_like(known)
        for other in apart.values():
            if other is not own:
                weight *= other / np.where(other == own, np.inf, other - own)
        known += weight * values[SIDE + by : ticks.size - SIDE + by]
    spread = apart[SIDE] - apart[-SIDE]
    usual = spread < TYPICAL * np.median(spread)
    return float(np.mean(np.abs(values[inner] - known)[usual]))
