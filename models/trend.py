"""Acceleration at the coming tick and its rate, from those of the last ticks.

An explicit integrator knows displacement and velocity of the interval's end, but the acceleration only up
to its beginning, and that carries the noise of the measured forces. A straight line through the last
accelerations, by least squares, is read one interval ahead.
"""

from __future__ import annotations

from models.compiled import jit
from models.registry import Array

RECENT = 6  # 12 ms at the default interval


@jit
def steepness(recent: Array) -> float:
    """Slope of the line per tick, towards the newest value."""
    middle = 0.5 * (recent.size - 1)
    above, below = 0.0, 0.0
    for i in range(recent.size):
        above += (middle - i) * recent[i]
        below += (middle - i) ** 2
    return above / below


@jit
def slope(recent: Array, interval: float) -> float:
    """Rate of the values per second."""
    return steepness(recent) / interval


@jit
def ahead(recent: Array) -> float:
    """The line's value one tick after the newest."""
    mean = 0.0
    for i in range(recent.size):
        mean += recent[i] / recent.size
    return mean + steepness(recent) * (0.5 * (recent.size - 1) + 1.0)
