"""Delay and gain of the measured force against what the specimen's model gives at the measured displacement.

Indices of tracking compare displacements, so a force that comes late is not seen by them although it takes as much
damping from the loop as a late displacement.
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

BLOCK = 2.0  # s; of the half-overlapping blocks that vouch for each other, shorter in a test of fewer than
LEAST_BLOCKS = 15
LEAST_TICKS = 32  # of a block
COHERENT = 0.9  # coherence from which on a frequency counts,
CHANCE = 1e-7  # where so many blocks of noise do not reach it more often,
EFFECTIVE = 4.0  # and this many blocks at least share its power: one strong block is coherent with anything
ROUNDS = 4  # of aligning the signals: blocks of time cut off what is late


class ForcePath(NamedTuple):
    """What the force does beside the displacement."""

    delay: float  # s, negative where the force leads
    interval: tuple[float, float]  # s, 95 %
    gain: float  # measured over expected, –
    frequency: float  # Hz, at which they are meant


class Cross(NamedTuple):
    """Coherent frequencies, and there, by block, the cross-spectrum and the power of the expected force."""

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
    """Values that come `ticks` later, on straight lines between them."""
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
    """How many blocks count, `(Σp)²/Σp²` over the first axis of their shares; 0 where all are 0."""
    squares = np.sum(shares**2, axis=0)
    return np.asarray(np.sum(shares, axis=0) ** 2 / np.where(squares > 0.0, squares, 1.0))


def cross(expected: Spectra, measured: Spectra, interval: float) -> Cross:
    """What both have in common at the frequencies, other than zero, at which they are coherent over the blocks.

    A block holds at most half of the power there, so that the sums without it never vanish.

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
            "The measured force is coherent with that of the specimen's model nowhere, or only for a moment."
        )
    omega = 2.0 * math.pi * np.fft.rfftfreq(2 * (kept.size - 1), interval)
    return Cross(np.asarray(omega[kept]), products[:, kept], powers[:, kept])


def left(omega: Array, spectrum: Spectra) -> float:
    """Delay (s) of least squares that a cross-spectrum of signals nearly aligned still holds."""
    return -float(np.sum(omega * np.imag(spectrum)) / np.sum(omega**2 * np.abs(spectrum)))


def jackknife(spectra: Cross) -> float:
    """Standard error of the delay (s), from its values without each block in turn."""
    count, whole = spectra.products.shape[0], spectra.products.sum(axis=0)
    without = [left(spectra.omega, whole - product) for product in spectra.products]
    return math.sqrt((count - 1) * float(np.var(without)))
