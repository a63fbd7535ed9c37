"""How sure a fit is of what it moved: curvature, and errors of the model that are correlated in time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.stats import norm, t

from diagnosis.fits import fitting
from diagnosis.fits.fitting import Fit
from diagnosis.fits.residuals import BLOCK
from diagnosis.recorded.parts import MODEL_ERROR
from models.registry import Array

COVERED = 0.95  # probability with which an interval holds the true parameter
# Largest share of what is known of a direction that a block may hold for itself. The others then know a tenth: less
# would divide by almost nothing.
ALONE = 0.9
FEWEST = 4  # blocks from which on their scatter says anything
# Times what curvature and scatter say: a laboratory follows another formula of its mechanism than the catalogue's. Of
# 72 parameters of laboratories with other formulas 54 lay within them, and 65 within twice as much.
FOREIGN = 2.0


class Spread(NamedTuple):
    """Covariance of what a fit moved: nominal parameters, in tolerances, and then the parameters of effects."""

    noise: Array  # from the curvature of the cost
    model: Array  # from errors that are correlated in time, beyond that
    blocks: int  # on which this second part rests

    @property
    def whole(self) -> Array:
        """Both together."""
        return np.asarray(self.noise + self.model)

    def half(self, place: int) -> float:
        """Standard deviations, of a normal distribution, by which an interval of one parameter ends: half its width.

        The scatter of few blocks is itself uncertain: Student's t, with degrees of freedom by Welch and Satterthwaite.
        """
        own, total = self.model[place, place], self.whole[place, place]
        if not total > 0.0:
            return 0.0
        freedom = (self.blocks - 1.0) * (total / own) ** 2 if own > 1e-9 * total else math.inf
        side = 0.5 * (1.0 + COVERED)
        wide = t.ppf(side, freedom) if math.isfinite(freedom) else norm.ppf(side)
        return float(wide * math.sqrt(total))


def spread(fit: Fit) -> Spread:
    """How sure a fit is of what it moved.

    Errors of a model are correlated over a block and hardly beyond it. Each block's part of the gradient is divided by
    the share that the other blocks know of a direction, because a fit makes what it has seen too small (the jackknife
    estimator CR3: R. M. Bell and D. F. McCaffrey, Survey Methodology 28 (2002)).
    """
    pieces, prior = list(by_block(fit)), np.zeros(fit.central.shape[1])
    prior[: fit.z.size] = 1.0
    white = np.sum([slopes.T @ slopes for slopes, _ in pieces], axis=0)
    information = white + np.diag(prior)
    inverse = np.linalg.pinv(information + 1e-12 * np.trace(information) * np.eye(len(information)))
    if len(pieces) < FEWEST:
        return Spread(inverse, np.zeros_like(inverse), len(pieces))
    values, vectors = np.linalg.eigh(0.5 * (inverse + inverse.T))
    root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    seen = -root @ white @ root
    for slopes, residuals in pieces:
        own, axes = np.linalg.eigh(root @ (slopes.T @ slopes) @ root)
        step = axes @ ((axes.T @ (root @ (slopes.T @ residuals))) / (1.0 - np.clip(own, 0.0, ALONE)))
        seen += np.outer(step, step)
    values, vectors = np.linalg.eigh(0.5 * (seen + seen.T))
    beyond = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return Spread(inverse, root @ beyond @ root, len(pieces))


def by_block(fit: Fit) -> Iterator[tuple[Array, Array]]:
    """Slopes (rows, parameters) and residuals (rows,) that a fit has seen, block by block, as it weighted signals."""
    groups, signals = fit.reduced.shape
    weights = fitting.weights(fit)
    slopes = fit.central.reshape(groups, signals, -1) * weights[:, None]
    residuals = fit.reduced * weights
    block = max(1, round(BLOCK / (fit.data.system.plan.test.interval * fit.data.group)))
    for begin in range(0, groups, block):
        seen = np.flatnonzero(fit.data.train[begin : begin + block]) + begin
        if seen.size:
            yield slopes[seen].reshape(seen.size * signals, -1), residuals[seen].ravel()


def covariance(fit: Fit) -> Array:
    """Covariance of what a fit moved: nominal parameters, in tolerances, and then the parameters of effects."""
    return spread(fit).whole


def between_solutions(fit: Fit) -> float:
    """How far, as a share of an effect's size, two good solutions of one model put a parameter: 95 % of cases."""
    return 0.0 if fit.data.part.exact else float(norm.ppf(0.5 * (1.0 + COVERED))) * MODEL_ERROR
