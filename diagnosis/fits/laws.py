"""A mechanism that has several laws: the one that fits best stands for it."""

from __future__ import annotations

import itertools

import numpy as np

from diagnosis.fits import fitting
from diagnosis.fits.fitting import Fit, excess
from laboratories.effects.effect import Effect

NEARER = (0.5, 0.65, 0.8, 1.0, 1.25)  # times the strength found under another law, where one begins
STEPS, ROUNDS = 8, 3  # of a fit
BETTER = 0.9  # of what is left beyond noise: less of it is worth another law than the first


def in_best_law(fit: Fit) -> Fit:
    """The fit with its last effect under the law that leaves least; the first one where none is much better."""
    effect = fit.data.catalogue[fit.names[-1]]
    others = [under(fit, effect, place) for place in range(1, len(effect.laws))]
    best = min(others, key=lambda item: item.cost, default=fit)
    return best if excess(best) < BETTER * excess(fit) else fit


def under(fit: Fit, effect: Effect, place: int) -> Fit:
    """The fit with an effect under the law at a place of its laws, from the best of some starts.

    All start from the plan's parameters, as those of a fit under a wrong law mean nothing.
    """
    base = effect.under(place, fit.values[effect.name])
    (strength,) = (item for item in effect.parameters if not item.shape)
    shape = next(item for item in effect.parameters if item.name in effect.laws[place].shapes)
    begun = []
    for share, size in itertools.product(NEARER, shape.sizes):
        values = base | {strength.name: share * base[strength.name], shape.name: size}
        begun.append(fitting.at(fit.data, fit.values | {effect.name: values}, np.zeros(fit.z.size)))
    start = min(begun, key=lambda item: item.cost)
    return fitting.fit(fit.data, start.values, start.z, STEPS, rounds=ROUNDS)
