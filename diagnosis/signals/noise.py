"""The step to which a sensor rounds its readings, found in the signal."""

from __future__ import annotations

import math

import numpy as np

from models.indicators.checks import checked
from models.registry import Array

ROUNDING = 4.0 * float(np.finfo(np.float64).eps)  # of a value, relative to the largest
COARSE = 1e3  # roundings that a step must exceed
# Levels from which on they tell of a step: the two gaps between three free floats have no common divisor.
LEVELS = 3
# Of how often the commonest level occurs, up to which one may have come about between two others.
SELDOM = 0.2
# Share of equal samples that must be multiples of a step, and how many times too large its first guess may be.
MOST, TIMES = 0.8, 12
ALIGNED = 1e-6  # of a step, within which a value counts as a multiple: far more than the rounding of floats


def quantum(x: Array) -> float:
    """Step of a signal (n,) whose values are integer multiples of one, about any offset; in x's unit.

    Greatest common divisor of the gaps between its levels, up to rounding. Zero where there is none: for a
    signal of free floats, or a constant one. A signal of two levels counts as quantised.

    Raises:
        InputError: empty or not finite.
    """
    checked(signal=x)
    rounding = ROUNDING * float(np.max(np.abs(x)))
    levels = merged(x, rounding)
    if levels.size < 2:
        return 0.0
    step = divisor(merged(np.diff(levels), 2.0 * rounding), 2.0 * rounding)
    if step == 0.0:
        return 0.0
    places = np.round((levels - levels[0]) / step)
    step = float(np.polyfit(places, levels - levels[0], 1)[0])
    off = levels - levels[0] - places * step
    return step if float(np.max(np.abs(off))) <= 4.0 * rounding else 0.0


def quantum_between(x: Array) -> float:
    """Step of a signal (n,) that was rounded to one and then interpolated linearly; in x's unit.

    Between two equal samples a straight line has their value, so that most equal neighbours are multiples of the step,
    and nearly all that occur again. Zero where these are too few or have none, as where a sensor repeats samples.

    Raises:
        InputError: empty or not finite.
    """
    checked(signal=x)
    levels, counts = np.unique(x[1:][np.diff(x) == 0.0], return_counts=True)
    often = counts > max(1.0, SELDOM * np.max(counts, initial=0.0))
    sure = levels[often] if np.count_nonzero(often) >= LEVELS else levels
    coarse = quantum(sure) if sure.size >= LEVELS else 0.0
    if coarse == 0.0:
        return 0.0
    for part in range(1, TIMES + 1):
        places = (levels - sure[0]) / (coarse / part)
        if np.average(np.abs(places - np.round(places)) < ALIGNED, weights=counts) >= MOST:
            return coarse / part
    return 0.0


def merged(x: Array, rounding: float) -> Array:
    """Values of x, ascending, of which those nearer than `rounding` count once."""
    values = np.unique(x)
    return np.asarray(values[np.concatenate([[True], np.diff(values) > rounding])])


def divisor(gaps: Array, rounding: float) -> float:
    """Greatest common divisor of ascending gaps (m,), each known up to `rounding`; 0 where it sinks to that.

    Euclid's algorithm; the divisor is sharpened by every larger gap, so that rounding does not add up.
    """
    step, along, square = 0.0, 0.0, 0.0
    for gap in gaps.tolist():
        rest, known = gap, max(math.sqrt(square), 1.0)
        if step > 0.0:
            rest = abs(math.remainder(gap, step))
        if rest > rounding * (2.0 + 2.0 * (gap / step if step > 0.0 else 0.0) / known):
            step = euclid(rest, step, rounding)
            along, square = 0.0, 0.0
        if step <= COARSE * rounding:
            return 0.0
        count = round(gap / step)
        along, square = along + count * gap, square + count * count
        step = along / square
    return step


def euclid(a: float, b: float, rounding: float) -> float:
    """Greatest common divisor of two lengths known up to `rounding`."""
    while b > 4.0 * rounding:
        a, b = b, abs(math.remainder(a, b))
    return a
