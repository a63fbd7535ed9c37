"""A mechanism that has several laws: the one that fits best stands for it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from diagnosis.fits import fitting
from diagnosis.fits.fitting import TIED, Fit, excess
from diagnosis.fits.hypothesis import Problem, Values
from diagnosis.fits.laws.specimen import SLOW, follow, path
from diagnosis.fits.laws.starts import starts
from diagnosis.fits.residuals import Data
from diagnosis.fits.threads import each
from diagnosis.fits.unexplained import remaining
from diagnosis.fits.worth import usual
from laboratories.effects.effect import Effect
from models.registry import Array

FITTED = 4  # of an effect's laws, those with the best starts
# Of the starts of a law over a brief beginning, those that are laid over a longer one; of these, over the whole test.
LONGER, LAID = 12, 3
ROUGH = 3  # steps of a first fit, after which laws are held against each other
LEADING = 4  # of all laws, those that are fitted to their end
STEPS, ROUNDS = 8, 2  # of such a fit
TURNS, EVALUATIONS = 2, 60  # of the simplex with the effects' parameters, each followed by a fit of all
LOGARITHMIC, LINEAR = 0.06, 0.4  # first edges of the simplex, of the logarithm and of a shape over its size
SURELY = 25.0  # cost by which a law with more free parameters must be better: 5 standard deviations squared
MOST_LEFT = 30.0  # times what the best fit leaves: one that leaves more is under no law the right one
# Systematic residual over noise below which one law is as good as another: it can hardly be seen.
SLIGHT = 0.02
BETTER = 0.9  # of what is left beyond noise: less of it is worth another law than the first


def in_best_laws(fits: list[Fit], *, modelled: bool = True) -> list[Fit]:
    """The fits, best first, with the effect that came last under that law of its mechanism that leaves least.

    Nothing is tried where the best fit leaves nothing. The best one is first fitted to its end under its own law:
    another law would else explain what that fit has not reached yet. Laws that are models of specimens, which take
    long, are tried if `modelled`.
    """
    if not fits or whole(fits[0]):
        return fits
    if len(last(fits[0]).laws) > 1:
        fits = sorted([fitting.polished(fits[0]), *fits[1:]], key=cost)
        if whole(fits[0]):
            return fits
    close = near(fits)
    others = raced([item for item in fits if item.names[-1] in close], modelled=modelled)
    better = ending(sorted((others.get(item.names[-1], item) for item in fits), key=cost), fits)
    return sorted([under_the_first(better[0]), *better[1:]], key=cost)


def as_specimens(bare: Fit, fits: list[Fit]) -> list[Fit]:
    """Fits with one effect, best first, and with those that are the whole specimen under a further law.

    An effect beside the planned specimen may promise little where it is right in that one's place: a slider behind a
    fixture follows no friction beside a spring. Effects that come near the best fit under their first law are there;
    beside a specimen that comes much nearer than these all others are looked at as specimens too.
    """
    way = path(bare.data.part)
    if way is None or not fits or whole(fits[0]):
        return fits
    others = {one.name: one for one in bare.data.part.candidates if models_of(one)}
    while missing := others.keys() - near(fits):
        found = [
            fitted(start, STEPS, ROUNDS)
            for name in sorted(missing)
            for start in modelled(bare, others.pop(name), way)[:1]
        ]
        least = {item.names[-1]: item for item in sorted([*found, *fits], key=cost, reverse=True)}
        fits = sorted(least.values(), key=cost)
    return fits


def near(fits: list[Fit]) -> set[str]:
    """The effects that came last in fits, best first, which leave no far more than the best."""
    return {item.names[-1] for item in fits if excess(item) <= MOST_LEFT * excess(fits[0])}


def modelled(bare: Fit, effect: Effect, way: tuple[Array, Array]) -> list[Fit]:
    """The fit with an effect under those of its laws that are models of the specimen, best first."""
    known = follow(bare.data.part, way, sorted(models_of(effect)))
    followed = {model: item.parameters for model, item in known.items()}
    (strength,) = (item for item in effect.parameters if not item.shape)
    plain = replace(bare, values={effect.name: effect.values({strength.name: strength.most})})
    places = [place for place, law in enumerate(effect.laws) if place and law.model in followed]
    return sorted((begun_under(plain, place, followed) for place in places), key=cost)


def whole(fit: Fit) -> bool:
    """Whether a fit leaves too little to be seen, with nominal parameters that stand in for nothing."""
    return remaining(fit) < SLIGHT and fit.prior <= usual(fit)


def ending(better: list[Fit], fits: list[Fit]) -> list[Fit]:
    """Fits, best first, with those that lead under another law than in `fits` moved to the bottom of their valley."""
    done: list[Fit] = []
    while better and not any(better[0] is item for item in (*fits, *done)):
        done.append(descended(better[0]))
        better = sorted([done[-1], *better[1:]], key=cost)
    return better


def under_the_first(fit: Fit) -> Fit:
    """The fit with its last effect under the first of its laws, if that is as good from where a further law has led.

    A fit under the first law may have stopped too early, past which a further law that is nearly the same has led.
    """
    effect, values = last(fit), fit.values[fit.names[-1]]
    if not values.get("law"):
        return fit
    start = fit.values | {effect.name: effect.under(0, values)}
    return simplest(fitting.fit(fit.data, start, fit.z), [fit])


def raced(fits: list[Fit], most: float = math.inf, *, modelled: bool = True) -> dict[str, Fit]:
    """The fits whose last effect leaves less under another law than the first, by that effect.

    The laws of all effects are fitted for a few steps, and those that then lead to their end, unless they leave more
    than `most` or far more than the best of the fits.
    """
    firsts = {item.names[-1]: item for item in reversed(fits)}
    starts = [start for item in firsts.values() for start in begun(item, modelled)]
    most = min(most, MOST_LEFT * min(map(excess, fits)))
    found: dict[str, list[Fit]] = {}
    rough = sorted(each(lambda start: fitted(start, ROUGH, 1), starts), key=cost)
    leading = [item for item in rough[:LEADING] if excess(item) <= most]
    for item in each(lambda item: fitted(item, STEPS, ROUNDS), leading):
        found.setdefault(item.names[-1], []).append(item)
    chosen = {name: simplest(firsts[name], others) for name, others in found.items()}
    return {name: item for name, item in chosen.items() if item is not firsts[name]}


def fitted(start: Fit, steps: int, rounds: int) -> Fit:
    """A fit moved on by a few steps."""
    return fitting.fit(start.data, start.values, start.z, steps, rounds=rounds)


def simplest(first: Fit, others: list[Fit]) -> Fit:
    """The first fit, or one under another law: with more free parameters only where it is much better."""
    best = first
    for item in sorted(others, key=frees):
        by = SURELY if frees(item) > frees(best) else TIED
        if item.cost < best.cost - by and excess(item) < BETTER * excess(best):
            best = item
    return best


def frees(fit: Fit) -> int:
    """How many parameters of effects a fit moves."""
    return len(Problem(fit.data, fit.values).frees)


def begun(fit: Fit, modelled: bool) -> list[Fit]:
    """The fit with its last effect under further laws, where a fit of each starts best: those with the best starts."""
    way = path(fit.data.part) if modelled else None
    models = sorted(models_of(last(fit))) if way is not None else []
    known = follow(fit.data.part, way, models) if way is not None else {}
    followed = {model: item.parameters for model, item in known.items()}
    slow = SLOW if modelled else models_of(last(fit))
    tried = [law.model not in slow or law.model in known for law in last(fit).laws]
    places = [place for place, wanted in enumerate(tried) if place and wanted]
    return sorted((begun_under(fit, place, followed) for place in places), key=cost)[:FITTED]


def models_of(effect: Effect) -> set[str]:
    """The models of specimens that further laws of an effect are."""
    return {law.model for law in effect.laws[1:] if law.model}


def begun_under(fit: Fit, place: int, followed: Mapping[str, Mapping[str, float]]) -> Fit:
    """The fit with its last effect under the law at a place of its laws, where a fit of it starts best.

    From the plan's parameters, as those of a fit under a wrong law mean nothing. `followed` are the parameters with
    which models of specimens follow the measured path, by model.
    """
    effect = last(fit)
    return cheapest(
        fit, [fit.values | {effect.name: values} for values in starts(fit, effect, place, followed)]
    )


def cheapest(fit: Fit, starts: Sequence[Values]) -> Fit:
    """Of hypotheses with the plan's parameters the one that costs least over the test, of those best over a beginning.

    The beginning holds most of what the fit leaves, so that those which cost much there cost much over the whole test.
    """
    z = np.zeros(fit.z.size)

    def laid(over: Data, starts: Sequence[Values]) -> list[Fit]:
        return sorted(each(lambda values: fitting.at(over, values, z), starts), key=cost)

    for share, most in ((fitting.BRIEFLY, LONGER), (fitting.MOSTLY, LAID)):
        if len(starts) > most:
            over = fitting.beginning(fit.data, fit, share)
            starts = [item.values for item in laid(over, starts)[:most]]
    return laid(fit.data, starts)[0]


def last(fit: Fit) -> Effect:
    """The effect of a fit that came last."""
    return fit.data.catalogue[fit.names[-1]]


def cost(fit: Fit) -> float:
    """The figure by which fits are ranked."""
    return fit.cost


def descended(fit: Fit) -> Fit:
    """The fit at the bottom of its valley, which is narrow and bent: by a simplex, which needs no slopes."""
    for _ in range(TURNS):
        problem, z = Problem(fit.data, fit.values), fit.z
        start = problem.place(fit.values, z)
        count = problem.count
        corners = np.tile(start[count:], (start.size - count + 1, 1))
        steps = [LOGARITHMIC if item.logarithmic else LINEAR for item in problem.frees]
        corners[1:] += np.diag(steps)

        def cost_of(free: Array, problem: Problem = problem, z: Array = z) -> float:
            values = problem.values(np.concatenate([z, free]))
            return fitting.at(problem.data, values, z).cost

        options = {"initial_simplex": corners, "maxfev": EVALUATIONS, "fatol": 1.0, "xatol": 1e-4}
        found = minimize(cost_of, start[count:], method="Nelder-Mead", options=options).x
        values = problem.values(np.concatenate([z, found]))
        fit = min(
            (fit, fitting.fit(fit.data, values, z, STEPS, rounds=1), fitting.at(fit.data, values, z)),
            key=lambda item: item.cost,
        )
    return fit
