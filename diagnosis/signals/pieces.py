"""A motion without a restoring force, cut into pieces that each begin at a place and with a rate of their own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.signals.mask import Mask
from models.registry import Array


def begun(missed: Array, there: Mask, starts: NDArray[np.int64], interval: float, decay: float) -> Array:
    """Of what a replay in pieces misses (ticks,), the share that follows from where and how fast each piece begins.

    That is known from a few noisy samples only, so the place and the rate are taken that fit best where `there`.
    `starts` are the first ticks of the pieces; a rate becomes slower by itself at `decay`, 1/s.
    """
    lengths = np.diff(np.append(starts, missed.size))
    after: Array = (np.arange(missed.size, dtype=np.float64) - np.repeat(starts, lengths)) * interval
    slope: Array = -np.expm1(-decay * after) / decay if decay > 0.0 else after
    counts = there.astype(np.float64)

    def summed(values: Array) -> Array:
        return np.asarray(np.add.reduceat(counts * values, starts))

    count, first, second = summed(np.ones(missed.size)), summed(slope), summed(slope**2)
    whole, along = summed(missed), summed(slope * missed)
    spread = np.maximum(count * second - first**2, np.finfo(np.float64).tiny)
    rate = (count * along - first * whole) / spread
    place = (whole - rate * first) / np.maximum(count, 1.0)
    return np.asarray(np.repeat(place, lengths) + np.repeat(rate, lengths) * slope)
