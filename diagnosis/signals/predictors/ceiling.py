"""How much of a residual any model could explain from the measurements, and on which of them it depends."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from diagnosis.signals.mask import Mask
from diagnosis.signals.predictors.features import features
from diagnosis.signals.systematic import systematic_rms
from models.indicators.checks import checked
from models.registry import Array

Name = TypeVar("Name", bound=str)  # of a coordinate

PERIOD = 0.01  # s, between the samples that the model sees: content up to 30 Hz and more
FOLDS = 4  # of the choice of the penalty
CHUNKS = 4  # of each fold, spread over the record, each longer than the features' memory
PENALTIES = 10.0 ** np.arange(-7.0, 4.0)  # per sample, over the features' mean square
SURE = 4.0  # standard errors of white noise's energy below which nothing systematic is there
KNOTS = 16  # of a function of one coordinate, evenly spread over its values and over its range
BLOCKS = 200  # of the cross-validation along the record, even and odd ones in turn


def ceiling(
    inputs: Array, residual: Array, train: Mask, held: Mask, noise_rms: float, interval: float = 0.002
) -> float:
    """Share (0…1) of a residual's systematic energy on withheld samples that a flexible model explains.

    Ridge regression of the residual (n,) on `features` of the inputs (n, p), both averaged over `PERIOD`,
    fitted where `train` (n,) is true with the penalty that predicts best across blocks of it, judged where
    `held` is. Zero where nothing surely systematic is there. `noise_rms` in the residual's unit.

    Raises:
        InputError: shapes do not fit, values are not finite, or a mask leaves too little.
    """
    columns = inputs[:, None] if inputs.ndim == 1 else inputs
    checked(residual=residual, **{f"input {i}": column for i, column in enumerate(columns.T)})
    step = max(1, round(PERIOD / interval))
    fit, judge = (
        averaged(train.astype(np.float64), step) > 1 - 1e-9,
        averaged(held.astype(np.float64), step) > 1 - 1e-9,
    )
    if fit.sum() < 4 * FOLDS or not judge.any():
        raise InputError("The masks leave too few samples to fit on or to judge by.")
    y, noise = averaged(residual, step), noise_rms**2 / step
    energy = float(np.mean(y[judge] ** 2)) - noise
    if energy <= SURE * noise * math.sqrt(2.0 / judge.sum()):
        return 0.0
    x = features(np.column_stack([averaged(column, step) for column in columns.T]), step * interval, fit)
    left = y[judge] - x[judge] @ ridge(x[fit], y[fit])
    gained = float(np.mean(y[judge] ** 2 - left**2))
    return min(max(gained / energy, 0.0), 1.0)


def averaged(x: Array, step: int) -> Array:
    """Means of x (n,) over `step` samples each; (n // step,)."""
    count = x.size // step
    return np.asarray(x[: count * step].reshape(count, step).mean(axis=1))


def ridge(x: Array, y: Array) -> Array:
    """Weights (q,) of features x (n, q) for y (n,), with the penalty that predicts withheld blocks best.

    All weights are zero where nothing predicts better than zero.
    """
    fold = folds(y.size)
    gram = [x[fold == k].T @ x[fold == k] for k in range(FOLDS)]
    product = [x[fold == k].T @ y[fold == k] for k in range(FOLDS)]
    whole, wanted = np.sum(gram, axis=0), np.sum(product, axis=0)
    lost = np.zeros(PENALTIES.size)
    for k in range(FOLDS):
        weights = along(whole - gram[k], wanted - product[k], int(np.sum(fold != k)))
        error = y[fold == k, None] - x[fold == k] @ weights
        lost += np.sum(error**2, axis=0)
    best = int(np.argmin(lost))
    if lost[best] >= float(y @ y):
        return np.zeros(x.shape[1])
    return np.asarray(along(whole, wanted, y.size)[:, best])


class Crosswise:
    """Predictions of series from features x (n, q), each block's without a look at it."""

    def __init__(self, x: Array) -> None:
        self._fold = folds(len(x))
        self._pieces = [x[self._fold == k] for k in range(FOLDS)]
        gram = [piece.T @ piece for piece in self._pieces]
        whole = np.sum(gram, axis=0)
        self._turned = [np.linalg.eigh(whole - one) for one in gram]
        self._beside = np.zeros((len(x), 0))

    @property
    def count(self) -> int:
        """Samples of a series."""
        return self._fold.size

    @property
    def swings(self) -> bool:
        """Whether columns stand beside the features: those of a resonance."""
        return bool(self._beside.size)

    def predict(self, y: Array) -> Array:
        """Predictions (n, m) of the columns of y (n, m).

        Each column has the penalty that predicts withheld blocks best, and zeros where nothing predicts better than
        zero.
        """
        said = self._ridge(y)
        return said + self._plain(y - said) if self.swings else said

    def beside(self, columns: Array) -> Crosswise:
        """The same with a few columns (n, k) more, which predict what these features leave, without a penalty."""
        more = copy.copy(self)
        more._beside = np.hstack([self._beside, columns])
        return more

    def _plain(self, y: Array) -> Array:
        """Predictions (n, m) of the columns of y (n, m) from the few columns; zeros as in `predict`."""
        said = np.zeros_like(y)
        for k in range(FOLDS):
            here = self._fold == k
            said[here] = self._beside[here] @ np.linalg.lstsq(self._beside[~here], y[~here], rcond=None)[0]
        return np.where(np.sum((y - said) ** 2, axis=0) < np.sum(y**2, axis=0), said, 0.0)

    def _ridge(self, y: Array) -> Array:
        """Predictions (n, m) from the features."""
        product = [piece.T @ y[self._fold == k] for k, piece in enumerate(self._pieces)]
        wanted = np.sum(product, axis=0)
        said = np.zeros((PENALTIES.size, *y.shape))
        for k, (values, vectors) in enumerate(self._turned):
            here = self._fold == k
            wants = vectors.T @ (wanted - product[k])
            heavy = np.maximum(values, 0.0)[:, None] + PENALTIES * int(np.sum(~here))
            weights = vectors @ (wants[:, None, :] / heavy[:, :, None]).reshape(len(values), -1)
            told = (self._pieces[k] @ weights).reshape(-1, PENALTIES.size, y.shape[1])
            said[:, here] = told.transpose(1, 0, 2)
        lost = np.sum((y - said) ** 2, axis=1)
        best = np.argmin(lost, axis=0)
        columns = np.arange(y.shape[1])
        worth = lost[best, columns] < np.sum(y**2, axis=0)
        return np.asarray(np.where(worth, said[best, :, columns].T, 0.0))


def folds(count: int) -> NDArray[np.int64]:
    """The fold (count,) that each sample belongs to: chunks of time in turn."""
    edges = np.linspace(0, count, CHUNKS * FOLDS + 1).astype(np.int64)
    return np.repeat(np.arange(CHUNKS * FOLDS) % FOLDS, np.diff(edges))


def along(gram: Array, product: Array, count: int) -> Array:
    """Ridge weights (q, penalties) for `PENALTIES`, of xᵀx (q, q) and xᵀy (q,) of `count` samples."""
    values, vectors = np.linalg.eigh(gram)
    scaled = (vectors.T @ product)[:, None] / (np.maximum(values, 0.0)[:, None] + PENALTIES * count)
    return np.asarray(vectors @ scaled)


def depends_on(
    coordinates: Mapping[Name, Array], residual: Array, noise_rms: float
) -> list[tuple[Name, float]]:
    """Share (0…1) of a residual's systematic energy that a function of each coordinate alone explains.

    Every coordinate (n,), such as a displacement, a rate or the time, on its own: a broken line over
    `KNOTS` of its values and of its range, fitted on every other block of the residual (n,), judged on the
    rest, and the other way round. The residual's mean is left out: it depends on nothing. Sorted, the largest
    first; zero where nothing surely systematic is there.

    Raises:
        InputError: lengths differ or values are not finite.
    """
    checked(residual=residual, **{str(name): values for name, values in coordinates.items()})
    varying = residual - residual.mean()
    found = systematic_rms(varying, noise_rms)
    energy = found.rms**2 if found.z > SURE else 0.0
    shares = [
        (name, min(max(explained(values, varying) / energy, 0.0), 1.0) if energy > 0.0 else 0.0)
        for name, values in coordinates.items()
    ]
    return sorted(shares, key=lambda entry: -entry[1])


def explained(coordinate: Array, residual: Array) -> float:
    """Mean square of the residual that a broken line of the coordinate predicts on withheld blocks."""
    x = hats(coordinate)
    odd = (np.arange(residual.size) * BLOCKS // residual.size) % 2 == 1
    gained = 0.0
    for judge in (odd, ~odd):
        fit = x[~judge]
        load = 1e-6 * fit.shape[0] * np.eye(x.shape[1])
        weights = np.linalg.solve(fit.T @ fit + load, fit.T @ residual[~judge])
        gained += float(np.sum(residual[judge] ** 2 - (residual[judge] - x[judge] @ weights) ** 2))
    return gained / residual.size


def hats(x: Array) -> Array:
    """Base (n, knots) of the broken lines of x (n,)."""
    even = np.quantile(x, np.linspace(0.0, 1.0, KNOTS))
    knots = np.unique(np.concatenate([even, np.linspace(x.min(), x.max(), KNOTS)]))
    if knots.size > 1:
        knots = knots[np.concatenate([[True], np.diff(knots) > 1e-3 / KNOTS * np.ptp(x)])]
    if knots.size == 1:
        return np.ones((x.size, 1))
    return np.column_stack([np.interp(x, knots, row) for row in np.eye(knots.size)])
