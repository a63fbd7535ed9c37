"""A mechanism that has several laws: the one that fits best stands for it."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.optimize import minimize

from diagnosis.fits import fitting
from diagnosis.fits.fitting import Fit, Problem, excess
from laboratories.effects.effect import Effect
from models.registry import Array

# Where a column stands once it has yielded hangs on all before, so that a fit from afar ends nowhere: starts are dense.
NEARER = np.geomspace(0.5, 1.3, 10)  # times the strength found under another law
FINER = (0.0, 0.5, 1.5)  # times the sizes of the first shape that a law has, beside these
FITTED = 2  # of the starts, the best ones
STEPS, ROUNDS = 8, 2  # of a fit
TURNS, EVALUATIONS = 2, 60  # of the simplex with the effects' parameters, each followed by a fit of all
LOGARITHMIC, LINEAR = 0.06, 0.4  # first edges of the simplex, of the logarithm and of a shape over its size
BETTER = 0.9  # of what is left beyond noise: less of it is worth another law than the first


def in_best_law(fit: Fit) -> Fit:
    """The fit with its last effect under the law that leaves least; the first one where none is much better."""
    effect = fit.data.catalogue[fit.names[-1]]
    others = [under(fit, effect, place) for place in range(1, len(effect.laws))]
    best = min(others, key=lambda item: item.cost, default=fit)
    return settled(best) if excess(best) < BETTER * excess(fit) else fit


def settled(fit: Fit) -> Fit:
    """The fit at the bottom of its valley, which is narrow and bent: by a simplex, which needs no slopes."""
    for _ in range(TURNS):
        problem, z = Problem(fit.data, fit.values), fit.z
        start = problem.place(fit.values, z)
        count = problem.count
        corners = np.tile(start[count:], (start.size - count + 1, 1))
        steps = [LOGARITHMIC if item.logarithmic else LINEAR for item in problem.frees]
        corners[1:] += np.diag(steps)

        def cost(free: Array, problem: Problem = problem, z: Array = z) -> float:
            values = problem.values(np.concatenate([z, free]))
            return fitting.at(problem.data, values, z).cost

        options = {"initial_simplex": corners, "maxfev": EVALUATIONS, "fatol": 1.0, "xatol": 1e-4}
        found = minimize(cost, start[count:], method="Nelder-Mead", options=options).x
        values = problem.values(np.concatenate([z, found]))
        fit = min(
            (fit, fitting.fit(fit.data, values, z, STEPS, rounds=1), fitting.at(fit.data, values, z)),
            key=lambda item: item.cost,
        )
    return fit


def under(fit: Fit, effect: Effect, place: int) -> Fit:
    """The fit with an effect under the law at a place of its laws, from the best of some starts.

    All start from the plan's parameters, as those of a fit under a wrong law mean nothing.
    """
    base = effect.under(place, fit.values[effect.name])
    (strength,) = (item for item in effect.parameters if not item.shape)
    shape = next(item for item in effect.parameters if item.name in effect.laws[place].shapes)
    sizes = {share * size for share in (*FINER, 1.0) for size in shape.sizes}
    begun = []
    for share, size in itertools.product(NEARER.tolist(), sorted(sizes)):
        values = base | {strength.name: share * base[strength.name], shape.name: size}
        begun.append(fitting.at(fit.data, fit.values | {effect.name: values}, np.zeros(fit.z.size)))
    begun.sort(key=lambda item: item.cost)
    fits = [fitting.fit(fit.data, item.values, item.z, STEPS, rounds=ROUNDS) for item in begun[:FITTED]]
    return min(fits, key=lambda item: item.cost)
