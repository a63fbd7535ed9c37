"""Intervals of what a fit moved: curvature, correlated errors of the model, and alternatives that are as probable.

The parameters of a verdict are fitted once more to all rows of a recording. A selection of effects must not see the
withheld ones; once it is made, they make the parameters surer, and so no interval rests on a part of the motion only.
The value beside an interval is that of the selection: how far a gap closes is judged with it, on rows it has not seen,
and `--found` writes it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from diagnosis.findings.certainty.costs import odds
from diagnosis.findings.certainty.covariances import COVERED, FOREIGN, between_solutions, spread
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits import fitting, hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Free, Problem

STEPS = 8  # of the fit to all rows, which begins close to its end
# Of a level, up to which a signal would go without it, from which on its flat part tells where the level is. There two
# formulas that agree below it differ by a tenth.
BEYOND = 1.5
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
