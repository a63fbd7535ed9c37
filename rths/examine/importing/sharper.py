"""A controller's clock that is known roughly, sharpened by the ticks that two rows of a logger share.

Rows that are hardly closer than ticks bound a tick seldom, where two of them share one, and then to a few hundredths of
an interval.
"""

from __future__ import annotations

import numpy as np

from models.registry import Array
from rths.examine.importing.ticks import ControllerClock

EQUAL = 1e-9  # s, below which two times are one
# Of an interval, by which clocks begin elsewhere, and are elsewhere at the end, closer and closer; how many of each.
SHARPER, ACROSS = (1e-1, 2e-2, 4e-3), 31


def sharpened(clock: ControllerClock, low: Array, high: Array) -> ControllerClock:
    """The clock, known roughly, within most of the bounds (runs,) of its ticks, s: in the middle of such clocks.

    One that is in step stays so where it is within all of them.
    """
    for share in SHARPER:
        if not low.size or (
            not clock.between and held(clock, low, high, np.zeros(1), np.zeros(1)) == low.size
        ):
            return clock
        later = share * clock.interval * np.linspace(-1.0, 1.0, ACROSS)
        fit = held(clock, low, high, later[:, None], later[None, :])
        begin, last = (later[places].mean() for places in np.nonzero(fit == fit.max()))
        lasts = max(1.0, float(of_bounds(clock, low, high)[-1])) * clock.interval
        clock = clock._replace(begin=clock.begin + float(begin), fast=clock.fast + float(last) / lasts)
    return clock._replace(unsure=0.0)


def held(clock: ControllerClock, low: Array, high: Array, begin: Array, last: Array) -> Array:
    """How many bounds hold for clocks that begin later by `begin` s (…), and are later by `last` s (…) at the end."""
    ticks = of_bounds(clock, low, high)
    ends = clock.begin + begin[..., None] + last[..., None] * (ticks / max(1.0, ticks[-1]))
    where = ends + (1.0 + clock.fast) * clock.interval * ticks
    return np.asarray(np.sum((low - EQUAL <= where) & (where <= high + EQUAL), axis=-1, dtype=np.float64))


def of_bounds(clock: ControllerClock, low: Array, high: Array) -> Array:
    """The ticks (runs,) that are bounded, by a clock that is known roughly."""
    return np.rint(clock.places(0.5 * (low + high)))
