"""Delay, amplitude and error of a measurement relative to its target."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from models.indicators.checks import checked, moving
from models.registry import Array

Index = NDArray[np.int64]

STILL = 1e-12  # of the whole signals' size: a part that varies by less is constant up to rounding
SETTLED = (
    1e-7  # s: the iteration ends when the delay changes by less, a hundredth of the 10 µs that are shown
)
PASSES = 20  # at most; two seconds of slow motion needed 15
AGREE_TICKS, AGREE_SHARE = 0.25, 0.03  # as `tracking_delay` says
TIE = 1e-3  # a correlation peak lower than the best one by no more than this counts as equal


class FrequencyEvaluation(NamedTuple):
    """Amplitude and delay by the frequency evaluation index."""

    amplitude: float  # measured over target, –
    delay: float  # s, negative where the measurement leads
    frequency: float  # Hz: mean frequency for which they hold


def frequency_evaluation_index(target: Array, measured: Array, interval: float) -> FrequencyEvaluation:
    """Amplitude, delay and mean frequency, each weighted by the target's power.

    `FEI = Σ (X_m/X_t)·|X_t|² / Σ |X_t|²`, amplitude `|FEI|`, delay `−arg(FEI)/(2π·f_eq)`, f_eq the mean
    frequency under |X_t|². `target` and `measured` (n,) in one unit, `interval` in s; means are removed and
    both are multiplied by a Hann window. A delay beyond half a period of f_eq is returned a period too short.

    Raises:
        InputError: signals empty, unequal, not finite or constant.

    Source: Guo, Chen, Chen, Chen and Li, Frequency-domain-based evaluation of actuator tracking, Smart
    Materials and Structures 23 (2014).
    """
    checked(target=target, measured=measured)
    moving(target=target)
    window = np.hanning(target.size)
    wanted = np.fft.rfft((target - np.average(target, weights=window)) * window)
    got = np.fft.rfft((measured - np.average(measured, weights=window)) * window)
    power = np.abs(wanted) ** 2
    index = np.sum(got * np.conj(wanted)) / np.sum(power)
    frequency = float(np.sum(power * np.fft.rfftfreq(target.size, interval)) / np.sum(power))
    phase = math.atan2(index.imag, index.real)
    return FrequencyEvaluation(float(abs(index)), -phase / (2.0 * math.pi * frequency), frequency)


def aligned_evaluation(target: Array, measured: Array, interval: float) -> FrequencyEvaluation:
    """The frequency evaluation index of a measurement that is first moved back by its own delay.

    The index uses the same window for both signals. A late motion of few cycles, or one that drifts, is weighted
    differently by the window in the measurement than in the target, which biases the delay: in 3 s of El Centro it
    gave 12.0 ms in place of 18.9 ms. So the measurement is moved back by the delay found, by a cubic spline, until no
    delay is left; the window then weights the same motion in both.

    Raises:
        InputError: signals empty, unequal, not finite or constant, or no delay at which the phase vanishes.
    """
    from scipy.interpolate import CubicSpline

    checked(target=target, measured=measured)
    moving(target=target, measured=measured)
    t = np.arange(target.size) * interval
    curve, delay = CubicSpline(t, measured), 0.0
    for _ in range(PASSES):
        known = (t + delay >= 0.0) & (t + delay <= t[-1])
        if 2 * np.count_nonzero(known) < t.size:
            break
        found = frequency_evaluation_index(target[known], curve(t[known] + delay), interval)
        delay += found.delay
        if abs(found.delay) < SETTLED:
            return found._replace(delay=delay)
    raise InputError("There is no delay at which target and measurement are in phase.")


def tracking_delay(by_index: float, by_correlation: float, interval: float) -> float | None:
    """The delay (s) by the aligned index if correlation gives the same, None where the two differ.

    The two weight the frequencies of a motion differently and err differently over few cycles, so that a delay on
    which both agree does not depend on the method. Over 4 s and more of three earthquakes, a sweep and a slow drift
    through table and actuator they differed by at most a quarter of an interval or 3 %; over a second they mostly
    differed by more.
    """
    allowed = max(AGREE_TICKS * interval, AGREE_SHARE * abs(by_correlation))
    return by_index if abs(by_index - by_correlation) <= allowed else None


def correlation_delay(target: Array, measured: Array, interval: float, most: float = 0.2) -> float:
    """Delay (s) at which target and measurement correlate best, between ±`most` s.

    Positive where the measurement is late, negative where it is early. Each lag is normalised by the part
    of both signals (n,) that overlaps there; a parabola through the best three gives the fraction of an
    interval. Of peaks as good as the best, as a sine has one every period, that nearest to no delay counts.

    Raises:
        InputError: signals empty, unequal, not finite, constant or shorter than the lags asked for, or no
            peak between these.
    """
    checked(target=target, measured=measured)
    moving(target=target, measured=measured)
    reach, n = math.ceil(most / interval), target.size
    if n < 4 * reach:
        raise InputError(f"{n} ticks are too few for delays up to {most:g} s: give at least {4 * reach}.")
    values = correlations(target, measured, -reach, reach)
    inner = (values[1:-1] >= values[:-2]) & (values[1:-1] >= values[2:])
    peaks = np.flatnonzero(inner & (values[1:-1] >= values.max() - TIE)) + 1
    if not peaks.size:
        raise InputError(f"The delay is not within ±{most:g} s: the correlation still grows there.")
    best = int(peaks[np.argmin(np.abs(peaks - reach))])
    before, at, after = values[best - 1 : best + 2]
    return float((best - reach + 0.5 * (before - after) / (before - 2.0 * at + after)) * interval)


def correlation_lag(target: Array, measured: Array, interval: float, ticks: int = 50) -> float:
    """Delay (s) of the first `ticks` whole ones at which target and measurement (n,) correlate best.

    Criterion J1 of the benchmark control problem. It knows no lead, which comes out as 0, and no part of a tick:
    `correlation_delay` does.

    Raises:
        InputError: signals empty, unequal, not finite, constant or not longer than the delays asked for.

    Source: Silva, Gomez, Maghareh, Dyke and Spencer, Mechanical Systems and Signal Processing 135 (2020) 106381.
    """
    checked(target=target, measured=measured)
    moving(target=target, measured=measured)
    if target.size <= ticks:
        raise InputError(f"{target.size} ticks are too few for {ticks} delays: give at least {ticks + 1}.")
    return interval * int(np.argmax(correlations(target, measured, 0, ticks - 1)))


def correlations(target: Array, measured: Array, first: int, last: int) -> Array:
    """Correlation coefficients of the target with a measurement `first` to `last` ticks late, negative for early.

    Each is that of the part of both signals (n,) that overlaps at its lag, the means there taken away. Products of all
    lags come from one transform, what they are normalised by from running sums; 0 where a part does not move.
    """
    n = target.size
    a, b = target - target.mean(), measured - measured.mean()
    size = 1 << (2 * n - 1).bit_length()
    whole = np.fft.irfft(np.conj(np.fft.rfft(a, size)) * np.fft.rfft(b, size), size)
    lags = np.arange(first, last + 1)
    kept = n - np.abs(lags)
    begin_a, begin_b = np.maximum(-lags, 0), np.maximum(lags, 0)
    mean_a, square_a = moments(a, begin_a, kept)
    mean_b, square_b = moments(b, begin_b, kept)
    products = whole[lags] - kept * mean_a * mean_b
    scale = np.sqrt(np.maximum(square_a, 0.0) * np.maximum(square_b, 0.0))
    moves = scale > STILL * math.sqrt(float(a @ a) * float(b @ b))
    return np.divide(products, scale, out=np.zeros(lags.size), where=moves)


def moments(values: Array, begin: Index, count: Index) -> tuple[Array, Array]:
    """Mean, and sum of squares about it, of several stretches of `values` (n,)."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    squares = np.concatenate([[0.0], np.cumsum(values * values)])
    mean = (sums[begin + count] - sums[begin]) / count
    return mean, squares[begin + count] - squares[begin] - count * mean * mean


def tracking_indicator(target: Array, measured: Array) -> Array:
    """Running area enclosed by measured over target (n,), in their units squared; it grows while the measurement lags.

    Raises:
        InputError: signals empty, unequal or not finite.

    Source: Mercan, Analytical and experimental studies on large scale, real-time pseudodynamic testing,
    dissertation, Lehigh University (2007).
    """
    checked(target=target, measured=measured)
    swept = 0.5 * (target[:-1] * measured[1:] - measured[:-1] * target[1:])
    return np.concatenate([[0.0], np.cumsum(swept)])


def nrmse(reference: Array, values: Array) -> float:
    """`rms(values − reference)/rms(reference)`; raises InputError for signals empty, unequal, not finite or zero."""
    checked(reference=reference, values=values)
    size = float(np.sqrt(np.mean(reference**2)))
    if size == 0.0:
        raise InputError("The reference is zero throughout: an error relative to it means nothing.")
    return float(np.sqrt(np.mean((values - reference) ** 2))) / size


def peak_error(reference: Array, values: Array) -> float:
    """`max|values − reference|/max|reference|`; raises InputError for signals empty, unequal, not finite or zero."""
    checked(reference=reference, values=values)
    size = float(np.max(np.abs(reference)))
    if size == 0.0:
        raise InputError("The reference is zero throughout: an error relative to it means nothing.")
    return float(np.max(np.abs(values - reference))) / size
