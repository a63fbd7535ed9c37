"""Stationary noise of any colour: autoregressive models by Burg's method, their densities, and whitening with them.

A density is given over `GRID`, shares of the Nyquist frequency, such that white noise of rms s has the density s²
everywhere: it says how much louder than a sample of white noise a frequency is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import fft, signal

from models.registry import Array

GRID: Array = np.concatenate([[0.0], np.geomspace(1e-4, 1.0, 400)])  # shares of the Nyquist frequency
MOST = 16  # order of a model: 0.13 s of averaged samples, longer than a filter of a sensor remembers
SLOW, SLOW_MOST = 16, 3  # averaged samples in a slow sample, order of the model of those
SLOW_LEAST = 24  # fewest slow samples from which slow noise is judged
SLACK = 0.06  # by which the variance of white noise may differ from that at the highest frequencies
# Standard errors beyond which noise is not white: fewer than those of a gap, as unseen colour looks like one.
WHITE = 3.0
SLOWER = (1, 4, 16)  # averaged samples in the sums by which that is decided
SEGMENT = 24  # samples that a segment must have
TAIL = 3.5  # standard deviations beyond which an innovation counts as one of the tail
# Samples at each end that mirroring changes, and deviations that these may have, as one normal number in 370 has. Noise
# behind a filter of order 8 at a sixth of the highest frequency had up to 90 deviations there, 8 samples further 4.
ENDS, LAST = 8, 3.0
CLEANED = 2  # rounds in which the tail is cut off before a model is fitted again


class Autoregression(NamedTuple):
    """Prediction-error filter of stationary noise and the variance of what it leaves."""

    weights: Array  # (order + 1,), the first is one
    variance: float

    @property
    def order(self) -> int:
        """How many samples it remembers."""
        return self.weights.size - 1

    def density(self, places: Array) -> Array:
        """Density at `places` (m,), shares of its Nyquist frequency."""
        steps = np.exp(-1j * np.pi * np.outer(places, np.arange(self.weights.size)))
        return np.asarray(self.variance / np.abs(steps @ self.weights) ** 2)


def burg(segments: Sequence[Array], most: int) -> list[Autoregression]:
    """Models of order 0 to `most` of noise that is known in pieces.

    Source: J. P. Burg, Maximum entropy spectral analysis (1975); over several segments the sums run over all.
    """
    ahead, behind = [x.copy() for x in segments], [x.copy() for x in segments]
    count = sum(x.size for x in segments)
    variance = sum(float(x @ x) for x in segments) / max(count, 1)
    weights = np.ones(1)
    found = [Autoregression(weights, variance)]
    for _ in range(most):
        pairs = [(f[1:], b[:-1]) for f, b in zip(ahead, behind, strict=True) if f.size > 1]
        energy = sum(float(f @ f) + float(b @ b) for f, b in pairs)
        if energy <= 0.0:
            break
        k = -2.0 * sum(float(f @ b) for f, b in pairs) / energy
        ahead, behind = [f + k * b for f, b in pairs], [b + k * f for f, b in pairs]
        weights = np.append(weights, 0.0) + k * np.append(0.0, weights[::-1])
        variance *= 1.0 - k * k
        found.append(Autoregression(weights, variance))
    return found


def chosen(models: Sequence[Autoregression], count: int, *, careful: bool) -> Autoregression:
    """The model that an information criterion prefers: Schwarz's where `careful`, else Akaike's corrected one.

    Source: G. Schwarz, Annals of Statistics 6 (1978); C. M. Hurvich and C.-L. Tsai, Biometrika 76 (1989).
    """

    def cost(model: Autoregression) -> float:
        free = model.order + 1
        fit = count * math.log(max(model.variance, 1e-300))
        if careful:
            return fit + free * math.log(count)
        return fit + (2.0 * free * count / (count - free - 1) if count > free + 1 else math.inf)

    return min(models, key=cost)


def autoregression(segments: Sequence[Array], most: int = MOST, *, careful: bool = False) -> Autoregression:
    """The model of noise that is known in pieces, robust against tails.

    Innovations beyond `TAIL` of the middle's deviation are cut off and the model is fitted again; its variance is that
    of all innovations, so that whitened noise has unit variance, tails included.
    """
    count = sum(x.size for x in segments)
    most = max(0, min(most, count // 10))
    model = chosen(burg(segments, most), count, careful=careful)
    for _ in range(CLEANED):
        pieces = [innovations(x, model) for x in segments]
        every = np.concatenate(pieces)
        limit = TAIL * 1.4826 * float(np.median(np.abs(every)))
        if limit <= 0.0 or not np.any(np.abs(every) > limit):
            break
        cleaned = [without_tail(x, e, limit) for x, e in zip(segments, pieces, strict=True)]
        model = chosen(burg(cleaned, most), count, careful=careful)
    every = np.concatenate([innovations(x, model) for x in segments])
    return Autoregression(model.weights, float(np.mean(every**2)))


def innovations(x: Array, model: Autoregression) -> Array:
    """What a model cannot predict of noise (n,) from its past; the first ones are predicted from what there is."""
    if model.order == 0:
        return x
    return np.asarray(signal.lfilter(model.weights, [1.0], x)[min(model.order, x.size - 1) :])


def without_tail(x: Array, innovation: Array, limit: float) -> Array:
    """Noise (n,) less what its innovations, the last of them for its last sample, exceed a limit by."""
    result = x.copy()
    result[x.size - innovation.size :] -= innovation - np.clip(innovation, -limit, limit)
    return result


def density(segments: Sequence[Array], *, careful: bool = False) -> tuple[Array, int]:
    """Density of noise over `GRID` and the order of its model; slow noise by a model of slow samples.

    A model that remembers a tenth of a second knows nothing of noise of a hertz, so averages over `SLOW` samples have a
    model of their own, which counts where it is the larger one, below half of their Nyquist frequency.
    """
    fast = autoregression(segments, careful=careful)
    result = fast.density(GRID)
    slowly = [averages(x) for x in segments if x.size >= 4 * SLOW]
    if sum(x.size for x in slowly) >= SLOW_LEAST:
        slow = autoregression(slowly, SLOW_MOST).density(np.minimum(GRID * SLOW, 1.0))
        result = np.where(GRID * SLOW < 0.5, np.maximum(result, slow), result)
    return result, fast.order


def averages(x: Array) -> Array:
    """Sums of noise (n,) over `SLOW` samples, scaled so that white noise keeps its rms."""
    count = x.size // SLOW
    return np.asarray(x[: count * SLOW].reshape(count, SLOW).sum(axis=1) / math.sqrt(SLOW))


def gains(density: Array, count: int) -> Array:
    """Factors (count,) on the lines of a cosine spectrum that make noise of a density over `GRID` white, of rms one."""
    places = np.arange(count) / count
    return np.asarray(np.exp(-0.5 * np.interp(places, GRID, np.log(density))))


def fast(count: int) -> int:
    """The least number of lines, no fewer than `count`, whose cosine spectra are fast: a product of 2, 3 and 5.

    Those of a number with a large prime factor take several times as long.
    """
    return int(fft.next_fast_len(count, real=True))


def whitened(x: Array, factors: Array) -> Array:
    """Series (n, m) with the lines of their cosine spectra times factors (l, m), l ≥ n: zero-phase, nothing wraps.

    A cosine transform mirrors a series at its ends, as a series with fewer samples than lines is here before. The bends
    that this makes are loud where a filter left no noise, so that samples near the ends of a series whose factors
    differ count as `LAST` deviations at most.
    """
    longer = np.concatenate([x, x[2 * len(x) - len(factors) :][::-1]]) if len(factors) > len(x) else x
    lines = factors * fft.dct(longer, axis=0, norm="ortho")
    result: Array = fft.idct(lines, axis=0, norm="ortho")[: len(x)]
    ends = np.ix_(np.r_[: min(ENDS, len(x)), max(0, len(x) - ENDS) : len(x)], np.ptp(factors, axis=0) > 0.0)
    result[ends] = np.clip(result[ends], -LAST, LAST)
    return result


def summed(segments: list[Array], size: int) -> Array:
    """Sums of noise over so many averaged samples, scaled so that white noise keeps its rms."""
    sums = [piece[: piece.size // size * size].reshape(-1, size).sum(axis=1) for piece in segments]
    return np.concatenate([np.zeros(0), *sums]) / math.sqrt(size)


def is_white(segments: list[Array], rms: float, resolution: float) -> bool:
    """Whether sums over a few averaged samples have the variance of white noise of an rms."""
    variance = rms**2 + resolution**2 / 12.0
    for size in SLOWER:
        every = summed(segments, size)
        if every.size < 8:
            continue
        spread = float(np.mean((every - np.median(every)) ** 2)) / max(variance, 1e-300) - 1.0
        if abs(spread) > SLACK + WHITE * math.sqrt(2.0 / every.size):
            return False
    return True


def heaviness(noise: Array) -> float:
    """How much more the energy of whitened noise (n,) varies than that of normal noise, from its fourth moment."""
    variance = float(np.mean(noise**2))
    kurtosis = float(np.mean(noise**4)) / variance**2 if variance > 0.0 else 3.0
    return math.sqrt(max(1.0, (kurtosis - 1.0) / 2.0))
