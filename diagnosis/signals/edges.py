"""The first and last ticks of a reading that a resampling filter spoilt, which has no rows beyond a recording's ends.

A filter that takes zeros or the last row for what it has not, or holds a row, bends the reading there from tick to
tick, as neither the motion of a machine nor the noise before does.
"""

from __future__ import annotations

import numpy as np

from diagnosis.signals.mask import Mask
from models.registry import Array

TICKS = 25  # of each end, which may be spoilt: half of a filter has some ten rows at the lower of both rates
AROUND = 500  # ticks beside these, whose noise is held against them
ORDER = 4  # of the differences that show a bend: those of a motion are small
BEYOND = 10.0  # of their usual size, from which on a difference is no noise, heavy tails included


def spoilt(residual: Array) -> Mask:
    """Where a residual (n,) is bent at its ends as it is nowhere beside them."""
    result = np.zeros(residual.size, dtype=bool)
    if residual.size < 2 * AROUND:
        return result
    result[: before(residual)] = True
    result[residual.size - before(residual[::-1]) :] = True
    return result


def before(residual: Array) -> int:
    """How many of a residual's first samples are spoilt."""
    apart = np.abs(np.diff(residual[: AROUND + TICKS], n=ORDER))
    bends = np.flatnonzero(apart[:TICKS] > BEYOND * np.median(apart[TICKS:]))
    return int(bends[-1]) + 1 + ORDER // 2 if bends.size else 0
