"""Delay and gain of the measured force relative to the force of the specimen's model at the measured displacement.

Tracking indices compare displacements, so they do not show a late force, although it takes as much damping from the
loop as a late displacement.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from models.indicators.checks import checked, moving
from models.registry import Array

Spectra = NDArray[np.complex128]

# s: length of the half-overlapping blocks, four cycles of the default building. It is shorter in a test that would have
# fewer than `LEAST_BLOCKS` of them, with which Student's factor (2.14) is within 10 % of that of the normal law (1.96).
BLOCK = 2.0
LEAST_BLOCKS = 15
LEAST_TICKS = 32  # of a block, which has fifteen frequencies between the mean and the highest one
COHERENT = (
    0.9  # least squared coherence at which a frequency counts: fifteen blocks give its phase to 3.5° (rms)
)
CHANCE = (
    1e-7  # largest probability that noise alone has that coherence: one in 10^4 for a thousand frequencies
)
EFFECTIVE = (
    4.0  # least number of blocks that share the power, because a single strong block is always coherent
)
ROUNDS = 4  # of aligning the signals: blocks cut off the late end of a signal, less of it with every round


class ForcePath(NamedTuple):
    """Delay and gain of the measured force relative to the expected one."""

    delay: float  # s, negative where the force leads
    interval: tuple[float, float]  # s, 95 %
    gain: float  # measured over expected, –
    frequency: float  # Hz: mean frequency for which they hold


class Cross(NamedTuple):
    """The coherent frequencies, and at them the cross-spectrum and the power of the expected force by block."""

    omega: Array  # (frequencies,) rad/s
    products: Spectra  # (blocks, frequencies)
    powers: Array  # (blocks, frequencies)


def force_path(expected: Array, measured: Array, interval: float, most: float = 0.2) -> ForcePath:
    """Delay (within ±`most` s) and gain that bring the expected force nearest to the measured one.

    `f_m(t) = g·f_e(t − τ)` by least squares over the frequencies at which both are coherent in blocks of time;
    `expected` and `measured` (n,) in one unit, `interval` in s. A linear phase weighted by the cross-spectrum's
    size, as in the frequency evaluation index, here with noise left out. The interval of 95 % is that of the
    jackknife over the blocks, by Student's distribution with as many degrees as blocks that count, less one.

    Raises:
        InputError: signals empty, unequal, not finite, constant, too short, or coherent at no frequency whose power
            at least four blocks share, as of a single pulse.

    Source: Knapp and Carter, IEEE Transactions on Acoustics, Speech, and Signal Processing 24 (1976) 320; Thomson and
    Chave, in Haykin (ed.), Advances in Spectrum Analysis and Array Processing 1 (1991) 58, for the jackknife; Carter,
    Knapp and Nuttall, IEEE Transactions on Audio and Electroacoustics 21 (1973) 337, for coherence by chance.
    """
    from scipy.special import stdtrit

    checked(expected=expected, measured=measured)
    moving(expected=expected, measured=measured)
    there = blocks(measured, interval)
    delay = coarse(expected, measured, interval, most)
    for _ in range(ROUNDS):
        spectra = cross(blocks(shifted(expected, delay / interval), interval), there, interval)
        delay += left(spectra.omega, spectra.products.sum(axis=0))
    shares = np.abs(spectra.products) @ spectra.omega**2
    wide = jackknife(spectra) * float(stdtrit(float(effective(shares)) - 1.0, 0.975))
    whole = spectra.products.sum(axis=0)
    frequency = float(np.average(spectra.omega, weights=np.abs(whole))) / (2.0 * math.pi)
    gain = float(np.sum(np.real(whole)) / np.sum(spectra.powers))
    return ForcePath(delay, (delay - wide, delay + wide), gain, frequency)


def coarse(expected: Array, measured: Array, interval: float, most: float) -> float:
    """Delay (s) in whole ticks at which the signals correlate best, within ±`most` s."""
    reach = min(int(most / interval), expected.size - 1)
    size = expected.size + reach
    here, there = (np.fft.rfft(values - np.mean(values), size) for values in (expected, measured))
    lags = np.arange(-reach, reach + 1)
    return float(lags[np.argmax(np.fft.irfft(np.conj(here) * there, size)[lags])] * interval)


def shifted(values: Array, ticks: float) -> Array:
    """Values (n,) delayed by `ticks`, by linear interpolation."""
    places = np.arange(values.size, dtype=np.float64)
    return np.asarray(np.interp(places - ticks, places, values))


def blocks(values: Array, interval: float) -> Spectra:
    """Spectra of half-overlapping blocks of time, each without its mean and under a Hann window.

    Shape (blocks, frequencies).

    Raises:
        InputError: there are too few values.
    """
    longest = max(LEAST_TICKS, round(BLOCK / interval))
    half = min(longest, 2 * values.size // (LEAST_BLOCKS + 1)) // 2
    size = 2 * half
    if size < LEAST_TICKS:
        least = (LEAST_BLOCKS + 1) * LEAST_TICKS // 2
        raise InputError(f"{values.size} ticks are too few for a delay of the force: give at least {least}.")
    window = np.hanning(size)
    rows = np.lib.stride_tricks.sliding_window_view(values, size)[::half]
    means = np.average(rows, axis=1, weights=window)
    spectra: Spectra = np.fft.rfft((rows - means[:, None]) * window, axis=1)
    return spectra


def effective(shares: Array) -> Array:
    """The effective number of blocks, `(Σp)²/Σp²` over the first axis of their shares p; 0 where all are 0."""
    squares = np.sum(shares**2, axis=0)
    return np.asarray(np.sum(shares, axis=0) ** 2 / np.where(squares > 0.0, squares, 1.0))


def cross(expected: Spectra, measured: Spectra, interval: float) -> Cross:
    """Cross-spectrum and power at the frequencies, other than zero, at which both are coherent over the blocks.

    No block holds more than half of the power there, so that the jackknife's sums without one block never vanish.

    Raises:
        InputError: there are none.
    """
    products, powers = measured * np.conj(expected), np.abs(expected) ** 2
    bounds = powers.sum(axis=0) * np.sum(np.abs(measured) ** 2, axis=0)
    common = np.abs(products.sum(axis=0)) ** 2
    count = np.maximum(effective(np.abs(products)), 1.0 + 1e-9)
    least = np.maximum(COHERENT, 1.0 - CHANCE ** (1.0 / (count - 1.0)))
    kept = (common > least * bounds) & (count >= EFFECTIVE)
    kept[[0, -1]] = False
    if not kept.any():
        raise InputError(
            "The measured force is coherent with that of the specimen's model at no frequency, or only for a moment: "
            "use a longer recording with more motion."
        )
    omega = 2.0 * math.pi * np.fft.rfftfreq(2 * (kept.size - 1), interval)
    return Cross(np.asarray(omega[kept]), products[:, kept], powers[:, kept])


def left(omega: Array, spectrum: Spectra) -> float:
    """The remaining delay (s) by least squares in the cross-spectrum of nearly aligned signals."""
    return -float(np.sum(omega * np.imag(spectrum)) / np.sum(omega**2 * np.abs(spectrum)))


def jackknife(spectra: Cross) -> float:
    """Standard error of the delay (s), from its values without each block in turn."""
    count, whole = spectra.products.shape[0], spectra.products.sum(axis=0)
    without = [left(spectra.omega, whole - product) for product in spectra.products]
    return math.sqrt((count - 1) * float(np.var(without)))
