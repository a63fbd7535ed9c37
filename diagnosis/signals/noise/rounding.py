"""The step to which a sensor rounds its readings, found in the signal."""

from __future__ import annotations

import math

import numpy as np

from models.indicators.checks import checked
from models.registry import Array

ROUNDING = 4.0 * float(np.finfo(np.float64).eps)  # of a value, relative to the largest
COARSE = 1e3  # roundings that a step must exceed
# Significant digits of a text that steps of a converter may be looked for behind. Of such a text: the most that a value
# errs by, in units of the last digit of a tenth of the largest one, and how many times that a step must exceed. Levels
# that it must have, as a few of them have a common divisor by chance, and the share of samples that may have a level of
# their own, as free floats do.
DIGITS, LAST_DIGIT, COARSE_PRINTED, FEWEST, RECURRING = (12, 10, 9, 8, 7, 6), 5.0, 50.0, 24, 0.5
INTERPOLATED = 1.5  # times a step, from which on another one is coarser
# Levels from which on they tell of a step: the two gaps between three free floats have no common divisor.
LEVELS = 3
# Of how often the commonest level occurs, up to which one may have come about between two others.
SELDOM = 0.2
SHOWS = 0.5  # steps over the noise, from which on the error of rounding, which depends on the motion, shows
# Share of equal samples that must be multiples of a step, and how many times too large its first guess may be.
MOST, TIMES = 0.8, 12
ALIGNED = 1e-6  # of a step, within which a value counts as a multiple: far more than the rounding of floats


def quantum(x: Array) -> float:
    """Step of a signal (n,) whose values are integer multiples of one, about any offset; in x's unit.

    Greatest common divisor of the gaps between its levels, up to rounding: that of numbers, or where values recur that
    of a text with a few digits. Zero where there is none: for a signal of free floats, or a constant one. A signal of
    two levels counts as quantised.

    Raises:
        InputError: empty or not finite.
    """
    checked(signal=x)
    step = lattice(x, ROUNDING, COARSE)
    if FEWEST < np.unique(x).size < RECURRING * x.size:
        printed = max(lattice(x, LAST_DIGIT * 10.0**-digits, COARSE_PRINTED) for digits in DIGITS)
        if printed > INTERPOLATED * step and not between(x, printed):
            return printed
    return step


def between(x: Array, step: float) -> bool:
    """Whether a signal (n,) with steps was interpolated between coarser ones, which many equal neighbours show."""
    return np.unique(x[1:][np.diff(x) == 0.0]).size > FEWEST and quantum_between(x) > INTERPOLATED * step


def lattice(x: Array, relative: float, coarse: float) -> float:
    """Step of a signal (n,) whose values are known to a share `relative` of the largest; 0 for none.

    A step must be `coarse` times as large as what a value may err by.
    """
    rounding = relative * float(np.max(np.abs(x)))
    levels = merged(x, rounding)
    if levels.size < 2:
        return 0.0
    step = divisor(merged(np.diff(levels), 2.0 * rounding), 2.0 * rounding, coarse)
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


def divisor(gaps: Array, rounding: float, coarse: float) -> float:
    """Greatest common divisor of ascending gaps (m,), each known up to `rounding`; 0 where it sinks to `coarse` of it.

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
        if step <= coarse * rounding:
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
