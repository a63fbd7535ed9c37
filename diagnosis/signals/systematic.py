"""The part of a residual that white noise does not explain."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy import fft, ndimage, signal

from models.indicators.checks import checked
from models.registry import Array

WIDTH = 0.5  # Hz over which the spectrum is smoothed
LEAST = 41  # lines over which it is smoothed at least
SURE = 3.0  # standard errors by which a smoothed line must exceed noise
MARGIN = 0.15  # share of the noise by which it must at least, as the noise's rms is an estimate too
LOW = 0.12  # of the Nyquist frequency: 30 Hz of a test at 2 ms


class Systematic(NamedTuple):
    """How much of a residual is systematic."""

    rms: float  # in the residual's unit
    z: float  # standard errors by which the low-frequency energy exceeds that of white noise


def spectrum(x: Array) -> Array:
    """Orthonormal cosine transform (n,) of x (n,): line k lies at k/(2·n·interval) Hz.

    Its even continuation meets itself at both ends, so nothing wraps around; white noise of rms s gives
    independent lines of rms s.
    """
    return np.asarray(fft.dct(x, type=2, norm="ortho"))


def systematic(residual: Array, noise_rms: float, interval: float) -> Array:
    """The part (n,) of a residual (n,) that stands above white noise of the given rms; in its unit.

    Empirical Wiener filter: each line of the cosine spectrum times `1 − noise/power`, the power smoothed over
    `WIDTH`, and zero where that does not surely exceed the noise. Zero-phase.

    Source: Wiener filter with the signal's power estimated as the excess over the noise's (spectral
    subtraction; Lim and Oppenheim, Proc. IEEE 67, 1979).

    Raises:
        InputError: empty or not finite.
    """
    checked(residual=residual)
    lines = spectrum(residual)
    width = min(max(LEAST, round(2.0 * WIDTH * residual.size * interval)), residual.size)
    power = ndimage.uniform_filter1d(lines**2, width, mode="reflect")
    sure = 1.0 + max(MARGIN, SURE * math.sqrt(2.0 / width))
    noise = noise_rms**2
    gain = np.where(power > sure * noise, 1.0 - noise / np.maximum(power, np.finfo(np.float64).tiny), 0.0)
    return np.asarray(fft.idct(gain * lines, type=2, norm="ortho"))


def systematic_rms(residual: Array, noise_rms: float, low: float = LOW) -> Systematic:
    """Rms of the systematic part of a residual (n,), and how sure it is there.

    Energy of the lines below `low` of the Nyquist frequency less that of white noise of the given rms, over
    n. White noise's has the standard error `noise_rms²·√(2·lines)`. Without noise, z is infinite or zero.

    Raises:
        InputError: empty or not finite.
    """
    checked(residual=residual)
    count = max(1, math.ceil(low * residual.size))
    energy = float(np.sum(spectrum(residual)[:count] ** 2))
    excess = energy - count * noise_rms**2
    error = noise_rms**2 * math.sqrt(2.0 * count)
    rms = math.sqrt(max(0.0, excess) / residual.size)
    if error == 0.0:
        return Systematic(rms, math.inf if energy > 0.0 else 0.0)
    return Systematic(rms, excess / error)


def correlations(values: Array, reach: int) -> Array:
    """Correlation of a series (n,) with itself at lags from one to `reach`."""
    whole = signal.correlate(values, values, method="fft")[values.size - 1 : values.size + reach]
    return np.asarray(whole[1:] / max(float(whole[0]), 1e-300))


def samples_per_sample(values: Array) -> float:
    """How many samples of a series (n,) tell as much of its variance as one of white noise: 1 + 2·Σρ² over its lags.

    Source: M. S. Bartlett, Journal of the Royal Statistical Society, Supplement 8 (1946).
    """
    return 1.0 + 2.0 * float(np.sum(np.square(correlations(values, values.size // 4))))
