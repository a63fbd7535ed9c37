"""A law of `models.preisach` found in a series by ridge regression, with its error on data not used for it.

Beside the law of all data two others serve to judge it: one from the seconds that fits of effects use, and one from all
but the stretch of the largest motion, which shows whether a law does more than interpolate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from diagnosis.signals.mask import Mask
from models import preisach
from models.preisach import Grid
from models.registry import Array

AVERAGED = 0.008  # s, over which samples are averaged: laboratories move much more slowly
BLOCK = 1.0  # s, of the pieces that are withheld in turn, as fits of effects withhold them
FOLDS, HELD = 5, (2, 4)  # of the cross-validation, and those that no fit of effects sees
STRONGEST = 0.2  # of the record, the stretch around the largest motion: some cycles of a strong phase
CORRELATED = 0.5  # s, longer than what a law leaves is correlated within a cycle
PENALTIES = 10.0 ** np.arange(-8.0, 2.0)  # over the mean square of the features
HARM = 0.25  # of what is gained in some withheld pieces, the most that may be lost in others: chance loses as it gains
LEAST = 0.05  # of the energy that must be predicted on withheld time: a smaller share is of no practical use
SIMPLER = 0.9  # of the error on withheld time, from which on a law that ages is worth its weights
COVER = 1.96  # standard deviations of a band of 95 %
FINE = (0.0, 0.002, 0.01, 0.03, 0.06, 0.1, 0.14, 0.18, 0.22, 0.26)
RADII = (*FINE, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.66, 0.73, 0.8, 0.9)
KNOTS = (0.15, 0.3, 0.45, 0.6, 0.75)
STEADY = Grid(RADII, KNOTS, ())
AGEING = Grid(RADII, KNOTS, (0.0, 0.3, 0.6))
BENDS, AGES = 0.3, 0.3  # expected size of the weights of bends and of ageing over those of straight lines


@dataclass(frozen=True)
class Regression:
    """A law and what is known of its error."""

    law: Array  # of all the data
    interleaved: Array  # of the pieces that fits of effects see
    weaker: Array  # of all but the strongest part
    strongest: tuple[int, int]  # ticks of that part, first and behind the last
    before: float  # rms of the series
    error: float  # rms of what the law leaves on withheld time
    covariance: Array  # (weights, weights) of the law's own uncertainty

    @property
    def share(self) -> float:
        """Share of the series' energy that is predicted on withheld time."""
        return 1.0 - (self.error / self.before) ** 2 if self.before > 0.0 else 0.0

    def band(self, x: Array, v: Array) -> Array:
        """Half width (n,) of the band of 95 % for a motion: wider where the state leaves the observed range."""
        rows = preisach.features(self.law[: self.law.size - preisach.count(self.law)], x, v)
        own = np.sum((rows @ self.covariance) * rows, axis=1)
        return np.asarray(COVER * np.sqrt(self.error**2 + np.maximum(own, 0.0)))


@dataclass(frozen=True)
class AveragedRows:
    """Averaged features (m, q), already scaled by what is expected of their weights, and the series (m,)."""

    grid: Array
    features: Array
    scale: Array  # (q,)
    series: Array
    piece: NDArray[np.int64]  # (m,)
    strong: Mask  # (m,) the strongest part

    @property
    def fold(self) -> NDArray[np.int64]:
        """The fold of each row."""
        return self.piece % FOLDS


@dataclass(frozen=True)
class Crossed:
    """A penalty with what it leaves of each row (m,) while that is withheld."""

    rows: AveragedRows
    penalty: float
    left: Array

    @property
    def error(self) -> float:
        """Mean square of the residual."""
        return float(np.mean(self.left**2))


def regress(x: Array, v: Array, y: Array, there: Mask, interval: float) -> Regression | None:
    """The law that gives y (n,) for a motion x (n,) m with rate v (n,) m/s, None where none predicts withheld time.

    Where `there` (n,) is false y is not known; `interval` in s.
    """
    reach, speed = float(np.max(np.abs(x))), float(np.max(np.abs(v)))
    if not (reach > 0.0 and speed > 0.0) or there.sum() < there.size / 2:
        return None
    strongest = around(x)
    found = [
        crossed(laid_out(preisach.pack(grid, reach, speed), x, v, y, there, strongest, interval))
        for grid in (STEADY, AGEING)
    ]
    steady, ageing = found
    best = ageing if ageing.error < SIMPLER**2 * steady.error else steady
    if not worth(best):
        return None
    return concluded(best, strongest, interval)


def around(x: Array) -> tuple[int, int]:
    """Ticks of the stretch around the largest motion, first and behind the last."""
    length = max(1, round(STRONGEST * x.size))
    first = min(max(int(np.argmax(np.abs(x))) - length // 2, 0), x.size - length)
    return first, first + length


def laid_out(
    grid: Array, x: Array, v: Array, y: Array, there: Mask, strongest: tuple[int, int], interval: float
) -> AveragedRows:
    """Averaged rows, those with missing samples left out."""
    step = max(1, round(AVERAGED / interval))
    count = x.size // step
    kept = there[: count * step].reshape(count, step).all(axis=1)
    tick = np.arange(count) * step
    block = max(1, min(round(BLOCK / (step * interval)), count // (2 * FOLDS)))
    piece = np.arange(count) // block
    strong = (tick >= strongest[0]) & (tick < strongest[1])
    scale = expected(grid)
    rows = preisach.features(grid, x, v)[: count * step].reshape(count, step, -1).mean(axis=1) * scale
    series = y[: count * step].reshape(count, step).mean(axis=1)
    return AveragedRows(grid, rows[kept], scale, series[kept], piece[kept], strong[kept])


def expected(grid: Array) -> Array:
    """How large the weights (q,) of a grid are expected to be beside each other."""
    radii, knots, ages = (int(grid[place]) for place in (preisach.RADII, preisach.KNOTS, preisach.AGES))
    one = np.array([1.0] + [BENDS] * (1 + 2 * knots) + [AGES] * ages)
    return np.concatenate([np.tile(one, radii), np.ones(preisach.RATES)])


def crossed(rows: AveragedRows) -> Crossed:
    """The penalty that predicts withheld folds best."""
    folds = range(FOLDS)
    a, y = rows.features, rows.series
    grams = [a[rows.fold == fold].T @ a[rows.fold == fold] for fold in folds]
    products = [a[rows.fold == fold].T @ y[rows.fold == fold] for fold in folds]
    gram, product = np.sum(grams, axis=0), np.sum(products, axis=0)
    load = np.trace(gram) / len(gram) * np.eye(len(gram))
    best: Crossed | None = None
    for penalty in PENALTIES:
        left = np.empty(y.size)
        for fold in folds:
            chosen = rows.fold == fold
            weights = solved(gram - grams[fold] + penalty * load, product - products[fold])
            left[chosen] = y[chosen] - a[chosen] @ weights
        found = Crossed(rows, float(penalty), left)
        best = found if best is None or found.error < best.error else best
    assert best is not None  # noqa: S101 - there are penalties
    return best


def solved(matrix: Array, right: Array) -> Array:
    """The solution of a symmetric positive system."""
    result: Array = cho_solve(cho_factor(matrix, check_finite=False), right, check_finite=False)
    return result


def worth(found: Crossed) -> bool:
    """Whether withheld time is predicted better than by nothing, and not by chance."""
    series = found.rows.series
    change = np.bincount(found.rows.piece, series**2 - found.left**2)
    gained, lost = float(np.sum(change[change > 0.0])), -float(np.sum(change[change < 0.0]))
    return lost < HARM * gained and gained - lost > LEAST * float(np.sum(series**2))


def concluded(found: Crossed, strongest: tuple[int, int], interval: float) -> Regression:
    """The law of all rows with its uncertainty, and those of some rows by which it is judged."""
    rows = found.rows
    error = float(np.sqrt(found.error))
    gram = rows.features.T @ rows.features
    load = found.penalty * np.trace(gram) / len(gram) * np.eye(len(gram))
    covariance = np.linalg.inv(gram + load) * together(found.left, interval) * error**2
    return Regression(
        law=law_of(rows, load, np.ones(rows.series.size, dtype=bool)),
        interleaved=law_of(rows, load, ~np.isin(rows.fold, HELD)),
        weaker=law_of(rows, load, ~rows.strong),
        strongest=strongest,
        before=float(np.sqrt(np.mean(rows.series**2))),
        error=error,
        covariance=rows.scale[:, None] * covariance * rows.scale,
    )


def law_of(rows: AveragedRows, load: Array, chosen: Mask) -> Array:
    """The law of some of the rows under a penalty (q, q)."""
    a = rows.features[chosen]
    return np.concatenate([rows.grid, rows.scale * solved(a.T @ a + load, a.T @ rows.series[chosen])])


def together(left: Array, interval: float) -> float:
    """How many averaged samples (m,) of the residual count as one, because it changes slowly."""
    length = max(1, round(CORRELATED / max(AVERAGED, interval)))
    count = left.size // length
    if count < 4:
        return 1.0
    sums = left[: count * length].reshape(count, length).sum(axis=1)
    return max(1.0, float(np.mean(sums**2)) / (length * float(np.mean(left**2)) + 1e-300))
