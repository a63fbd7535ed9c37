"""Dead time, time constant and gain from a step by the tangent at the inflection, as in the paper.

The tangent meets the start level at L and the steady level T later; K is the final over the commanded step. The step as
the actuator sees it is a ramp of one interval, so times count from the ramp's middle; of a held command they count from
the step's tick. Smoothing: after the onset the response is fitted by a polynomial of second order in `e^(−t/T₀)`, where
T₀ is a first estimate from the times at 28 % and 63 % (Smith 1957). The fit has no bias for a first-order lag and can
follow responses of higher order. Source: section 3.2 of Yokoyama et al. (17WCEE, 2020).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from common.errors import InputError
from laboratories.identification import checks
from laboratories.identification.estimate import Estimate, around
from models.registry import Array

BEFORE = 5  # least number of samples of the start level, for its mean and its noise
MOST_BEFORE = 200  # largest number of them: with 0.4 s at 2 ms the level is 14 times as certain as one sample
LEAST_AFTER = 20  # least number of samples after the step: a fifth of them, four, gives the steady level
STEADY = 0.2  # share of the record after the step that is averaged for the steady level
# Share of the rise by which the two halves of that part may differ, in addition to noise: an error of the steady level
# of that size shifts T by 0.3 %.
UNSTEADY = 0.003
LEVELS = (0.283, 0.632)  # of the rise: 1 − e^(−1/3) and 1 − e^(−1), which a lag reaches T/3 and T after L
WINDOW = 2.0  # length of the smoothing window over T₀, in which a first-order lag makes 86 % of its rise
ORDER = 2  # of the polynomial: a lag, and its first correction for a response of higher order
BACK = 2.5  # ticks by which the fitted curve is extrapolated back to the start level, over the ramp and the guard
SIGNIFICANT = 10.0  # rise over noise below which a step is refused: T is then uncertain by more than 10 %


class StepResponse(NamedTuple):
    """The result of the tangent method."""

    delay: Estimate  # L, s
    time_constant: Estimate  # T, s
    gain: Estimate  # K


class RiseCurve(NamedTuple):
    """The smoothed rise: times in s from the ramp's middle, heights as share of the rise."""

    base: float  # time of the window's first sample
    earliest: float  # beginning of the extrapolated curve
    end: float  # end of the window
    fade: float  # T₀
    weights: Array  # (ORDER + 1,)
    covariance: Array  # of the weights


def tangent(t: Array, command: Array, measured: Array, begin: int, *, held: bool = False) -> StepResponse:
    """L (s), T (s) and K from one step by the tangent at the inflection.

    `t` (s), `command` (m) and `measured` (m) have one value per tick; `command` is constant except for its step from
    tick `begin` − 1 to tick `begin`; the record ends in the steady state. The intervals follow from the measured noise
    and from the sensitivity to the position of the smoothing window.

    Raises:
        InputError: too short, not finite, no step at `begin`, another step beside it, or no steady end.

    Source: section 3.2 of Yokoyama et al. (17WCEE, 2020).
    """
    t, command, measured = checks.signals(
        BEFORE + LEAST_AFTER, time=t, command=command, displacement=measured
    )
    if np.any(np.diff(t) <= 0.0):
        raise InputError("The time does not increase from tick to tick: give the ticks in their order.")
    size = checked_step(command, begin)
    interval = float(t[-1] - t[0]) / (t.size - 1)
    before = measured[max(begin - MOST_BEFORE, 0) : begin + 1]
    after = measured[begin:]
    tail = after[-max(int(STEADY * after.size), 5) :]
    start, steady = float(before.mean()), float(tail.mean())
    rise = steady - start
    noise = float(np.sqrt((before.var(ddof=1) + tail.var(ddof=1)) / 2.0))
    if abs(rise) < SIGNIFICANT * noise or rise == 0.0:
        raise InputError(
            f"The step at tick {begin} moves the displacement by less than ten times its noise: make a larger step."
        )
    white = float(np.std(np.diff(tail))) / np.sqrt(2.0)  # without what drifts
    drift = float(tail[tail.size // 2 :].mean() - tail[: tail.size // 2].mean())
    if abs(drift) > UNSTEADY * abs(rise) + 8.0 * white / np.sqrt(tail.size):
        raise InputError(
            f"The displacement is not steady at the end of the step at tick {begin}: record longer."
        )
    times = t[begin:] - t[begin] - (0.0 if held else interval / 2.0)
    share = (after - start) / rise
    relative = noise / abs(rise)
    near, far = (smooth(times, share, relative, interval, guard) for guard in (1, 2))
    lag, constant, gradient = read(near)
    other = read(far)
    variance = np.einsum("ij,jk,ik->i", gradient, near.covariance, gradient)
    level, end = relative**2 / before.size, relative**2 / tail.size
    # a raised start level moves L by T per unit; either level moves T by T per unit
    spread_delay = np.sqrt(variance[0] + constant**2 * level + (other[0] - lag) ** 2 / 2.0)
    spread_constant = np.sqrt(variance[1] + constant**2 * (level + end) + (other[1] - constant) ** 2 / 2.0)
    spread_gain = abs(rise / size) * np.sqrt(level + end)
    return StepResponse(
        around(lag, float(spread_delay), "s"),
        around(constant, float(spread_constant), "s"),
        around(rise / size, float(spread_gain), ""),
    )


def tangents(
    t: Array, command: Array, measured: Array, steps: Sequence[int], length: int, *, held: bool = False
) -> StepResponse:
    """Mean L (s), T (s) and K of several steps in one record, with intervals from their scatter.

    Arrays are those of `tangent`; `steps` are the ticks at which a step begins, `length` is the number of ticks from
    there on that belong to each. For a single step the result is that of `tangent`.

    Raises:
        InputError: as `tangent`, or no step given, or a step that reaches over the record's end.
    """
    if not steps:
        raise InputError("No step is given: name the ticks at which the command steps.")
    t, command, measured = checks.signals(
        BEFORE + LEAST_AFTER, time=t, command=command, displacement=measured
    )
    found = []
    for begin in steps:
        if begin < 1 or begin + length > command.size:
            raise InputError(
                f"The step at tick {begin} with {length} ticks reaches over the record of {command.size} ticks."
            )
        still = begin - 1
        while still > 0 and begin - still < MOST_BEFORE // 4 and command[still - 1] == command[begin - 1]:
            still -= 1
        part = slice(still, begin + length)
        found.append(tangent(t[part], command[part], measured[part], begin - still, held=held))
    if len(found) == 1:
        return found[0]
    return StepResponse(*(mean([step[i] for step in found]) for i in range(len(found[0]))))


def mean(values: Sequence[Estimate]) -> Estimate:
    """Mean of repeated estimates with the interval of their scatter."""
    numbers = np.array([value.value for value in values])
    deviation = float(numbers.std(ddof=1)) / np.sqrt(numbers.size)
    return around(float(numbers.mean()), deviation, values[0].unit, numbers.size - 1)


def checked_step(command: Array, begin: int) -> float:
    """Height of the only step of the command, at tick `begin`."""
    if not BEFORE <= begin <= command.size - LEAST_AFTER:
        raise InputError(
            f"The step at tick {begin} needs {BEFORE} ticks before and {LEAST_AFTER} behind it in the record."
        )
    jumps = np.flatnonzero(np.diff(command)) + 1
    if begin not in jumps:
        raise InputError(
            f"The command does not step at tick {begin}: name the tick that holds the new value."
        )
    if jumps.size > 1:
        other = int(jumps[jumps != begin][0])
        raise InputError(
            f"The command moves at tick {other} too: cut the record to one step or use tangents."
        )
    return float(command[begin] - command[begin - 1])


def smooth(times: Array, share: Array, noise: float, interval: float, guard: int) -> RiseCurve:
    """Fit of the first window after the onset that the curve fits within the noise, moved on by `guard` ticks."""
    passed = [int(np.argmax(share >= level)) for level in LEVELS]
    crossed = [
        float(np.interp(level, share[k - 1 : k + 1], times[k - 1 : k + 1])) if k > 0 else float(times[0])
        for k, level in zip(passed, LEVELS, strict=True)
    ]
    fade = max(1.5 * (crossed[1] - crossed[0]), interval)
    count = max(round(WINDOW * fade / interval), 4 * (ORDER + 1))
    onset = passed[0]
    while onset > 0 and share[onset - 1] > 4.0 * noise + 1e-6:
        onset -= 1
    misfits = [fit(times, share, first, count, fade)[1] for first in range(onset, passed[1] + 1)]
    sizes = np.array([np.sqrt(np.mean(misfit**2)) for misfit in misfits])
    heads = np.array([np.abs(misfit[:3]).max() for misfit in misfits])
    tolerance = max(1.5 * noise, 7.5e-4, 1.2 * float(sizes.min()))
    fits = (sizes <= tolerance) & (heads <= max(2.5 * tolerance, 1.2 * float(heads.min())))
    first = onset + int(np.argmax(fits if fits.any() else sizes <= tolerance))
    weights, misfit, base = fit(times, share, first + guard, count, fade)
    variance = float(misfit @ misfit) / max(misfit.size - ORDER - 1, 1)
    covariance = np.asarray(np.linalg.pinv(base.T @ base) * variance, dtype=np.float64)
    begin = float(times[first + guard])
    return RiseCurve(
        begin, begin - BACK * interval, begin + misfit.size * interval, fade, weights, covariance
    )


def fit(times: Array, share: Array, first: int, count: int, fade: float) -> tuple[Array, Array, Array]:
    """Weights, misfit and base of the polynomial in `e^(−t/T₀)` over `count` ticks from `first` on."""
    window = slice(first, first + count)
    base = np.vander(np.exp(-(times[window] - times[first]) / fade), ORDER + 1, increasing=True)
    weights = np.asarray(np.linalg.lstsq(base, share[window], rcond=None)[0], dtype=np.float64)
    return weights, base @ weights - share[window], base


def heights(curve: RiseCurve, weights: Array, time: Array) -> tuple[Array, Array]:
    """Height and slope (1/s) of the smoothed rise."""
    x = np.exp(-(time - curve.base) / curve.fade)
    powers = np.arange(ORDER + 1)
    table = x[:, None] ** powers
    return table @ weights, -(table * powers) @ weights / curve.fade


def draw(curve: RiseCurve, weights: Array) -> Array:
    """L and T (2,) of the tangent at the steepest point, which is searched back to the start level."""
    grid = np.linspace(curve.earliest, curve.end, 1500)
    height, slope = heights(curve, weights, grid)
    under = np.flatnonzero((height <= 0.0) & (grid < curve.base))
    from_here = int(under[-1]) if under.size else 0
    if not under.size:  # with a smooth onset the curve does not come back to the start level
        from_here = int(np.argmax(grid >= curve.base))
    place = from_here + int(np.argmax(slope[from_here:]))
    steepest = float(slope[place])
    if steepest <= 0.0:
        raise InputError("The displacement does not rise after the step: check the record.")
    return np.array([grid[place] - height[place] / steepest, 1.0 / steepest])


def read(curve: RiseCurve) -> tuple[float, float, Array]:
    """L, T, and their gradient (2, ORDER + 1) with respect to the curve's weights."""
    middle = draw(curve, curve.weights)
    gradient = np.empty((2, ORDER + 1))
    for i in range(ORDER + 1):
        nudge = np.zeros(ORDER + 1)
        nudge[i] = max(2.0 * float(np.sqrt(curve.covariance[i, i])), 1e-6)
        above, below = draw(curve, curve.weights + nudge), draw(curve, curve.weights - nudge)
        gradient[:, i] = (above - below) / (2.0 * nudge[i])
    return float(middle[0]), float(middle[1]), gradient
