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

BLOCK = 4.0  # s; of the blocks that vouch for each other, shorter in a test of fewer than
LEAST_BLOCKS = 8
LEAST_TICKS = 32  # of a block
COHERENT = 0.9  # coherence from which on a frequency counts: noise reaches it in 8 blocks once in 10⁷
ROUNDS = 4  # of aligning the signals: blocks of time cut off what is late
STUDENT = (2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131, 2.120)  # 97.5 % at 7 to 16 degrees
NORMAL = 1.96


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
    jackknife over the blocks, by Student's distribution.

    Raises:
        InputError: signals empty, unequal, not finite, constant, too short, or coherent at no frequency.

    Source: Knapp and Carter, IEEE Transactions on Acoustics, Speech, and Signal Processing 24 (1976) 320; Thomson and
    Chave, in Haykin (ed.), Advances in Spectrum Analysis and Array Processing 1 (1991) 58, for the jackknife.
    """
    checked(expected=expected, measured=measured)
    moving(expected=expected, measured=measured)
    there = blocks(measured, interval)
    delay = coarse(expected, measured, interval, most)
    for _ in range(ROUNDS):
        spectra = cross(blocks(shifted(expected, delay / interval), interval), there, interval)
        delay += left(spectra.omega, spectra.products.sum(axis=0))
    error = jackknife(spectra)
    wide = error * (
        STUDENT[there.shape[0] - LEAST_BLOCKS] if there.shape[0] < LEAST_BLOCKS + len(STUDENT) else NORMAL
    )
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
    """Spectra of successive blocks of time, each without its mean and under a Hann window; (blocks, frequencies).

    Raises:
        InputError: there are too few values.
    """
    count = max(LEAST_BLOCKS, int(values.size * interval / BLOCK))
    size = values.size // count // 2 * 2
    if size < LEAST_TICKS:
        least = LEAST_BLOCKS * LEAST_TICKS
        raise InputError(f"{values.size} ticks are too few for a delay of the force: give at least {least}.")
    window = np.hanning(size)
    rows = values[: count * size].reshape(count, size)
    means = np.average(rows, axis=1, weights=window)
    spectra: Spectra = np.fft.rfft((rows - means[:, None]) * window, axis=1)
    return spectra


def cross(expected: Spectra, measured: Spectra, interval: float) -> Cross:
    """What both have in common at the frequencies, other than zero, at which they are coherent over the blocks.

    Raises:
        InputError: there are none.
    """
    products, powers = measured * np.conj(expected), np.abs(expected) ** 2
    bounds = powers.sum(axis=0) * np.sum(np.abs(measured) ** 2, axis=0)
    common = np.abs(products.sum(axis=0)) ** 2
    kept = common > COHERENT * bounds
    kept[[0, -1]] = False
    if not kept.any():
        raise InputError("The measured force has nothing to do with what the specimen's model gives.")
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
