"""Resonances in a residual: oscillators that something swings, found by the frequency at which it follows best.

What swings for many periods depends on its input of seconds ago, which no lag of `features` reaches. An oscillator is a
pair of complex poles; the real and the imaginary part of zₖ = e^((−ζ+i√(1−ζ²))·ωΔ)·zₖ₋₁ + uₖ span what it makes of an
input u.

Source: B. Wahlberg, System identification using Kautz models, IEEE Transactions on Automatic Control 39 (1994).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import signal

from diagnosis.signals.noise import colour
from diagnosis.signals.predictors.ceiling import FOLDS, folds
from models.registry import Array

LOWEST, HIGHEST = 0.4, 40.0  # Hz
UP_TO = 0.4  # of the sampling frequency, above which averaged samples show little
DAMPING = (0.01, 0.03, 0.09)  # ratios: of bolted steel, of a liquid or a cable, and of rubber
APART = 1.4  # half widths of a resonance between two frequencies
LINES = 0.4  # lines of the record's spectrum between two at least
ALIKE = 1e-9  # share of the energy of one of two columns that the other must leave

Columns = npt.NDArray[np.float32]
ComplexArray = npt.NDArray[np.complexfloating]


class Sums(NamedTuple):
    """What one input's oscillators and series have in common, fold by fold."""

    energy: Array  # (folds, 3, poles): of the real part, of both together, and of the imaginary part
    product: Array  # (folds, 2, poles, m) of either part with the series


class Resonances:
    """Oscillators that one of several inputs (n, p), sampled every `interval` s, swings.

    The inputs are made white first: what they have most of is what lags explain.
    """

    def __init__(self, inputs: Array, interval: float) -> None:
        apart = inputs - inputs.mean(axis=0)
        self._inputs = [white(column / rms) for column in apart.T if (rms := column.std()) > 0.0]
        self._poles = poles(interval, len(inputs))
        self._fold = folds(len(inputs))

    def columns(self, y: Array) -> Array:
        """The two columns (n, 2) of the oscillator that series y (n, m) together follow most."""
        place = self._foremost(list(self._sums(y)), np.ones(FOLDS, dtype=bool))[0]
        return self._column(*place)

    def predict(self, y: Array) -> Array:
        """Predictions (n, m) of the columns of y (n, m), each block's without a look at it for choice or size."""
        sums, said = list(self._sums(y)), np.zeros_like(y)
        for k in range(FOLDS):
            place, weights = self._foremost(sums, np.arange(FOLDS) != k)
            here = self._fold == k
            said[here] = self._column(*place)[here] @ weights
        return said

    def _column(self, number: int, pole: int) -> Array:
        """Real and imaginary part (n, 2) of one oscillator."""
        swung = signal.lfilter([1.0], [1.0, -self._poles[pole]], self._inputs[number].astype(np.complex128))
        return np.column_stack([swung.real, swung.imag])

    def _sums(self, y: Array) -> Iterator[Sums]:
        """What each input's oscillators have in common with series (n, m)."""
        series = y.astype(np.float32)
        edges = np.flatnonzero(np.diff(self._fold, prepend=-1, append=-1))
        for column in self._inputs:
            energy = np.zeros((FOLDS, 3, self._poles.size))
            product = np.zeros((FOLDS, 2, self._poles.size, y.shape[1]))
            state = np.zeros(self._poles.size, dtype=np.complex64)
            for begin, end in itertools.pairwise(edges):  # all of a long record would not fit into the memory
                real, imaginary, state = swung(column[begin:end], self._poles, state)
                pairs = ((real, real), (real, imaginary), (imaginary, imaginary))
                here = self._fold[begin]
                energy[here] += [np.einsum("ij,ij->j", one, other) for one, other in pairs]
                product[here] += [part.T @ series[begin:end] for part in (real, imaginary)]
            yield Sums(energy, product)

    def _foremost(self, sums: list[Sums], seen: npt.NDArray[np.bool_]) -> tuple[tuple[int, int], Array]:
        """Input and pole that explain most of the folds `seen` (folds,), and the weights (2, m) there."""
        best: tuple[float, tuple[int, int], Array] = (-math.inf, (0, 0), np.zeros((2, 1)))
        for number, one in enumerate(sums):
            energy, product = one.energy[seen].sum(axis=0), one.product[seen].sum(axis=0)
            weights = solved(energy, product)
            gain = np.einsum("ikm,ikm->k", weights, product)
            place = int(np.argmax(gain))
            if gain[place] > best[0]:
                best = float(gain[place]), (number, place), weights[:, place]
        return best[1], best[2]


def poles(interval: float, count: int) -> ComplexArray:
    """Poles (k,) of oscillators: as close in frequency as their damping and `count` samples can tell."""
    found = []
    for damping in DAMPING:
        frequency = LOWEST
        while frequency < min(HIGHEST, UP_TO / interval):
            omega = 2.0 * math.pi * frequency * interval
            found.append(np.exp((-damping + 1j * math.sqrt(1.0 - damping**2)) * omega))
            frequency += max(APART * damping * frequency, LINES / (count * interval))
    return np.array(found)


def white(x: Array) -> Array:
    """An input (n,) less what its own past predicts of it."""
    model = colour.autoregression([x])
    return np.asarray(signal.lfilter(model.weights, [1.0], x))


def swung(x: Array, of: ComplexArray, state: ComplexArray) -> tuple[Columns, Columns, ComplexArray]:
    """Real and imaginary parts (n, k) of what an input (n,) makes of oscillators with poles (k,), and their last state.

    `state` (k,) is theirs before it.
    """
    result = np.empty((x.size, of.size), dtype=np.complex64)
    step = of.astype(np.complex64)
    for place, value in enumerate(x.astype(np.float32)):
        state = state * step + value
        result[place] = state
    return np.ascontiguousarray(result.real), np.ascontiguousarray(result.imag), state


def solved(energy: Array, product: Array) -> Array:
    """Weights (2, k, m) of the two columns of each pole, by least squares."""
    aa, ab, bb = energy[:, :, None]
    of_a, of_b = product
    whole = np.maximum(aa * bb - ab**2, ALIKE * aa * bb + 1e-300)
    return np.stack([bb * of_a - ab * of_b, aa * of_b - ab * of_a]) / whole
