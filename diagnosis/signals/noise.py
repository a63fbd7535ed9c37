"""What a signal owes to its sensor: white noise and quantisation."""

from __future__ import annotations

import math

import numpy as np

from models.indicators.checks import checked
from models.registry import Array

PHYSICAL = 40.0  # Hz, below which a test's physical content lies
ORDER = 4  # of the differences that find spikes and steps
NORMAL = 0.674489750196082  # median of |x| of a standard normal variable
CLIP = 3.0  # standard deviations beyond which a sample does not count as noise
ATTENUATION = 120.0  # dB, of physical content
STEPS = 30  # of the clipped deviation's fixed point
OUTLIER = 6.0  # standard deviations from which a difference is a spike or a step
DISAGREE = 1.25  # band over differences, from which the band holds more than noise
ROUNDING = 4.0 * float(np.finfo(np.float64).eps)  # of a value, relative to the largest
COARSE = 1e3  # roundings that a step must exceed


def white_rms(x: Array, interval: float) -> float:
    """Rms of the white noise in a signal x (n,) sampled every `interval` s; in x's unit.

    The deviation, clipped at three sigma and corrected for that, of the band above `PHYSICAL`; samples within
    reach of a spike or a step are left out. Where too few are left, or the band holds more than noise, that
    of fourth differences, which reach five samples only. Zero for a constant signal.

    Raises:
        InputError: empty or not finite.
    """
    checked(signal=x)
    if x.size <= 2 * ORDER:
        return 0.0
    differences = np.diff(x, ORDER) / math.sqrt(math.comb(2 * ORDER, ORDER))
    near = clipped_rms(differences)
    taps = high_pass(interval)
    if near == 0.0 or x.size < 3 * taps.size:
        return near
    odd = np.concatenate([np.abs(differences) > OUTLIER * near, np.zeros(ORDER, dtype=bool)])
    reach = np.convolve(odd, np.ones(taps.size + ORDER), mode="full")[ORDER : ORDER + x.size] > 0.5
    kept = np.convolve(x - x.mean(), taps, mode="valid")[~reach[taps.size - 1 :]]
    if kept.size < x.size // 2:
        return near
    wide = clipped_rms(kept)
    return wide if wide < DISAGREE * near else near


def high_pass(interval: float) -> Array:
    """Linear-phase filter (odd, symmetric, unit energy) of the band from twice `PHYSICAL` to Nyquist."""
    stop = min(max(2.0 * PHYSICAL * interval, 0.05), 0.4)  # of the Nyquist frequency
    half = math.ceil((ATTENUATION - 7.95) / (2.285 * math.pi * stop) / 2.0)
    beta = 0.1102 * (ATTENUATION - 8.7)
    place = np.arange(-half, half + 1)
    low = 1.5 * stop * np.sinc(1.5 * stop * place) * np.kaiser(place.size, beta)
    taps = -low / low.sum()
    taps[half] += 1.0
    return np.asarray(taps / math.sqrt(float(taps @ taps)))


def clipped_rms(x: Array) -> float:
    """Standard deviation of zero-mean Gaussian samples (n,) of which some are none; 0 where half are zero.

    Fixed point of the rms within `CLIP` sigma over that of a clipped normal, from the median deviation.
    """
    size = np.abs(x)
    sigma = float(np.median(size)) / NORMAL
    density = math.exp(-0.5 * CLIP**2) / math.sqrt(2.0 * math.pi)
    share = 1.0 - 2.0 * CLIP * density / math.erf(CLIP / math.sqrt(2.0))
    for _ in range(STEPS):
        within = size[size <= CLIP * sigma]
        if sigma == 0.0 or within.size == 0:
            return 0.0
        before, sigma = sigma, math.sqrt(float(np.mean(within**2)) / share)
        if abs(sigma - before) <= 1e-6 * before:
            break
    return sigma


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
