"""Intervals of what a fit moved: curvature, correlated errors of the model, and alternatives that are as probable.

The parameters of a verdict are fitted once more to all rows of a recording. A selection of effects must not see the
withheld ones; once it is made, they make the parameters surer, and so no interval rests on a part of the motion only.
The value beside an interval is that of the selection: how far a gap closes is judged with it, on rows it has not seen,
and `--found` writes it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.stats import norm, t

from diagnosis.findings.certainty.costs import odds
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits import fitting, hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Free, Problem
from diagnosis.fits.residuals import BLOCK
from diagnosis.recorded.parts import MODEL_ERROR
from models.registry import Array

COVERED = 0.95  # probability with which an interval holds the true parameter
STEPS = 8  # of the fit to all rows, which begins close to its end
# Largest share of what is known of a direction that a block may hold for itself. The others then know a tenth: less
# would divide by almost nothing.
ALONE = 0.9
FEWEST = 4  # blocks from which on their scatter says anything
# Of a level, up to which a signal would go without it, from which on its flat part tells where the level is. There two
# formulas that agree below it differ by a tenth.
BEYOND = 1.5
# Times what curvature and scatter say: a laboratory follows another formula of its mechanism than the catalogue's. Of
# 72 parameters of laboratories with other formulas 54 lay within them, and 65 within twice as much.
FOREIGN = 2.0
HALVINGS = 60  # in which the end of an interval is found, to a part in 10¹⁸ of where it is looked for
REACH = 12.0  # standard deviations of the widest component within which an end is looked for


@dataclass(frozen=True)
class Interval:
    """A parameter with its interval."""

    value: float
    low: float
    high: float
    unit: str
    on_bound: bool


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


def refined(fit: Fit) -> Fit:
    """A fit moved to the best parameters for all rows, those included that selection did not see."""
    data = fit.data.whole
    return fitting.moved(data, replace(fit, data=data), STEPS, None, fitting.weights(fit))


def intervals(verdict: PartVerdict) -> dict[str, dict[str, Interval]]:
    """Parameters of the effects that a verdict names as selected, with 95 % intervals by a fit to all rows."""
    search = verdict.searched
    fit = refined(search.chosen)
    problem, sure = Problem(fit.data, fit.values), spread(fit)
    low, high = problem.bounds()
    place = problem.place(fit.values, fit.z)
    chances = list(zip(search.alternatives, odds(search), strict=True))
    result: dict[str, dict[str, Interval]] = {}
    for i, item in enumerate(problem.frees, start=fit.z.size):
        half = math.hypot(FOREIGN * sure.half(i), between_formulas(fit, item), between_solutions(fit))
        shifts = ((moved_by(search.chosen, other, item), chance) for other, chance in chances)
        others = [(shift, chance) for shift, chance in shifts if shift is not None]
        ends = (place[i] + end for end in mixed(half, others))
        down, up = (item.outward(float(np.clip(end, low[i], high[i]))) for end in ends)
        edge = 1e-6 * (high[i] - low[i])
        value = search.chosen.values[item.effect][item.parameter.name]
        result.setdefault(item.effect, {})[item.parameter.name] = Interval(
            value,
            min(down, up, value),
            max(down, up, value),
            item.parameter.unit,
            not low[i] + edge < item.inward(value) < high[i] - edge,
        )
    return result


def between_solutions(fit: Fit) -> float:
    """How far, as a share of an effect's size, two good solutions of one model put a parameter: 95 % of cases."""
    return 0.0 if fit.data.part.exact else float(norm.ppf(0.5 * (1.0 + COVERED))) * MODEL_ERROR


def between_formulas(fit: Fit, item: Free) -> float:
    """How far, as a fit moves it, another formula may put a level at which a signal bends; 0 for all else.

    A reading that goes beyond its level shows it; what bends within a machine is not read. By
    value/(1 + |value/L|ⁿ)^(1/n) a signal is smaller by |value/L|ⁿ/n near zero, by L'·tanh(|value/L'|ᵐ)^(1/m) by
    |value/L'|²ᵐ/(3m). These agree for m = n/2 and L' = L/1.5^(1/n).
    """
    given = fit.values[item.effect]
    effect = fit.data.catalogue[item.effect]
    if item.parameter.bends_by not in given:
        return 0.0
    if effect.signal:
        others = {name: values for name, values in fit.values.items() if name != item.effect}
        free = fit.data.part.predict(hypothesis.lay(fit.data, fit.z, others))
        peak = float(np.nanmax(np.abs(free[:, fit.data.part.signals.index(effect.signal)])))
        if peak >= BEYOND * given[item.parameter.name]:
            return 0.0
    return math.log(1.5) / given[item.parameter.bends_by]


def moved_by(chosen: Fit, other: Fit, item: Free) -> float | None:
    """How far a parameter lies elsewhere in another fit, as a fit moves it; None where that has no such parameter."""
    given = other.values.get(item.effect)
    name = item.parameter.name
    if given is None or given.get("law") != chosen.values[item.effect].get("law") or name not in given:
        return None
    return item.inward(given[name]) - item.inward(chosen.values[item.effect][name])


def mixed(half: float, others: list[tuple[float, float]]) -> tuple[float, float]:
    """Ends of an interval about 0 of half this width where alternatives, with their odds, put the parameter elsewhere.

    `others` are the alternatives' shifts and odds, one being those of the chosen effects. Each has the same spread.
    """
    if not half > 0.0 or not any(shift != 0.0 and chance > 0.0 for shift, chance in others):
        return -half, half
    side = 0.5 * (1.0 + COVERED)
    deviation = half / float(norm.ppf(side))
    shifts = np.array([0.0, *(shift for shift, _ in others)])
    chances = np.array([1.0, *(chance for _, chance in others)])
    chances /= chances.sum()

    def end(share: float) -> float:
        low, high = shifts.min() - REACH * deviation, shifts.max() + REACH * deviation
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            below = float(chances @ norm.cdf((middle - shifts) / deviation)) < share
            low, high = (middle, high) if below else (low, middle)
        return float(high)

    return end(1.0 - side), end(side)
