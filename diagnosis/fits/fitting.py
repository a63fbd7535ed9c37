"""Fits of a hypothesis: nominal parameters inside their tolerances, and the parameters of its effects.

    cost = Σ (residual/σ)²/κ + Σ z²

z counts tolerances, so the second sum is the prior that the plan states: a maximum a posteriori fit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from diagnosis.fits.hypothesis import Problem, Values, lay
from diagnosis.fits.residuals import Data
from diagnosis.fits.threads import each
from diagnosis.recorded.building.building import Building
from diagnosis.signals.mask import Mask
from models.registry import Array

ROUNDS = 4  # fits with the signals' weights renewed in between
SHORTEST, LONGEST = 6.0, 0.7  # of a beginning: seconds, and share of the test
# Share of what a fit leaves that a beginning must hold, so that the rest of the test teaches little.
MOSTLY = 0.7
BRIEFLY = 0.3  # the same of one over which many starts of a law are compared before
# Share of what a fit leaves, beyond noise, that must lie on either side of what it sees: with less a fit finds little,
# or little judges it; and the share with which it finds nothing, or nothing judges it.
ONE_SIDED, NOTHING = 0.1, 0.01
NEAR = 1.0  # tolerances within which fits begin: a parameter that is further away imitates an effect
LOST = 100.0  # mean square residual in σ² from which on fitted nominal parameters mean nothing
# Times what a rival leaves, beyond which a fit comes no nearer by further steps or at the bottom of its valley: these
# have taken away a third of what a fit left at most.
CLOSE = 3.0
CHANCE = 3.0  # standard deviations by which a signal costs less than its noise by chance
TIED = 9.0  # cost by which hypotheses differ that can be told apart: 3 standard deviations squared
# Of the largest speed over which friction may turn round, from which on it is none: dry friction takes a tenth of it.
TURNS = 0.5
END = 1e-6  # of its range, within which an effect's parameter counts as at its end
POLISHED = 12  # steps of a fit that leaves something, before that counts


@dataclass(frozen=True, eq=False)
class Fit:
    """A hypothesis at its best: where its parameters are and what it costs. Each equals itself alone."""

    data: Data
    values: Values
    z: Array  # (nuisances,)
    reduced: Array  # (groups, signals) residuals in σ

    @property
    def names(self) -> tuple[str, ...]:
        """Its effects."""
        return tuple(self.values)

    @cached_property
    def jacobian(self) -> Array:
        """Derivative of the residuals over z, then over the effects' parameters, (groups·signals, parameters)."""
        problem = Problem(self.data, self.values)
        return problem.jacobian(problem.place(self.values, self.z), self.reduced.ravel())

    @cached_property
    def central(self) -> Array:
        """The derivative by differences to both sides.

        What those to one side err by makes parameters look apart that no data can tell apart, as a stiffness and the
        effect on it.
        """
        problem = Problem(self.data, self.values)
        place = problem.place(self.values, self.z)
        return 0.5 * (self.jacobian + problem.jacobian(place, self.reduced.ravel(), side=-1.0))

    @property
    def seen_slopes(self) -> Array:
        """The slopes of the residuals that the fit has seen, (groups·signals of these, parameters)."""
        return np.asarray(self.jacobian[np.repeat(self.data.train, self.data.sigma.size)])

    @property
    def prior(self) -> float:
        """Σ z²."""
        return float(self.z @ self.z)

    @property
    def chi(self) -> float:
        """Σ (residual/σ)² of the groups that judge, scaled to as many as there are."""
        held = self.reduced[self.data.judging]
        return float(np.mean(np.square(held))) * self.reduced.size

    @property
    def cost(self) -> float:
        """The figure by which hypotheses are ranked: on the time that judges, with the prior."""
        return self.chi + self.prior


def fit(
    data: Data,
    start: Values,
    z: Array | None = None,
    steps: int = 12,
    slopes: Array | None = None,
    rounds: int = ROUNDS,
) -> Fit:
    """Best parameters from a start; without effects it is the commissioning fit.

    `z` (nuisances,) where the nominal parameters begin, `slopes` as `Problem` takes them. A signal that
    a hypothesis misses by far more than noise counts by what it misses, round by round, so that it does
    not drag along the parameters that other signals know better.
    """
    found = at(data, start, z if z is not None else np.zeros(len(data.part.nuisances)))
    for _ in range(rounds):
        before, found = found, moved(data, found, steps, slopes, weights(found))
        if abs(before.chi - found.chi) < 1.0 + 1e-3 * excess(found):
            break
    return found


def weights(fit: Fit) -> Array:
    """Weights of the signals' residuals (signals,): less than one for a signal that a fit misses by more than noise."""
    return np.asarray(1.0 / np.sqrt(np.maximum(1.0, np.mean(np.square(fit.reduced), axis=0))))


def excess(fit: Fit) -> float:
    """What a fit costs beyond noise."""
    return beyond_noise(fit, fit.data.judging) + fit.prior


def beyond_noise(fit: Fit, judging: Mask) -> float:
    """What residuals cost beyond noise by averaged samples (groups,), scaled to as many as there are.

    A signal that costs less than its noise, because its σ is what a model may err by, does not pay for what another one
    misses, but for what chance gives.
    """
    held = fit.reduced[judging]
    more = np.mean(np.square(held), axis=0) - fit.data.live
    chance = CHANCE * math.sqrt(2.0 / len(held))
    return max(0.0, float(np.sum(np.maximum(more, -chance))) * fit.data.groups)


def one_sided(fit: Fit, least: float = ONE_SIDED) -> bool:
    """Whether of what a fit leaves less than a share lies in the groups that it has seen, or in those that judge.

    An effect that acts in a second or two only cannot be found in one half of the time and judged in the other.
    """
    extra = np.sum(np.square(fit.reduced), axis=1) - fit.data.size / fit.data.groups
    seen, judging = float(extra[fit.data.train].sum()), float(extra[fit.data.judging].sum())
    larger = max(seen, judging)
    return not fit.data.train.all() and larger > 0.0 and min(seen, judging) < least * larger


def near(fit: Fit, rival: Fit) -> bool:
    """Whether a fit that has been moved on for long may still leave no more than a rival."""
    return excess(fit) < CLOSE * max(excess(rival), TIED)


def moved(data: Data, fit: Fit, steps: int, slopes: Array | None, weights: Array) -> Fit:
    """A fit moved to the best parameters under weights of the signals."""
    problem = Problem(data, fit.values, slopes, weights)
    low, high = problem.bounds()
    there = problem.place(fit.values, fit.z)
    p = np.clip(there, low + 1e-9, high - 1e-9)
    if np.array_equal(p, there):
        problem.keep(p, fit.reduced)
    if p.size:
        arguments: dict[str, Any] = {"bounds": (low, high), "x_scale": "jac", "ftol": 1e-6, "xtol": 1e-6}
        p = least_squares(problem.stacked, p, jac=problem.stacked_jacobian, max_nfev=steps, **arguments).x
    return Fit(data, problem.values(p), p[: problem.count], problem.reduced(p))


def everywhere(fit: Fit) -> float:
    """What a fit costs beyond noise on all groups, those included that it has seen.

    Fits that have not reached their end are ranked by it: an effect may show in few seconds, all of which they see,
    and until they have found its size they may be worse on the others.
    """
    return beyond_noise(fit, np.ones(fit.data.groups, dtype=bool)) + fit.prior


def at(data: Data, values: Values, z: Array) -> Fit:
    """A hypothesis at given parameters, nothing fitted."""
    return Fit(data, values, z, data.reduced(lay(data, z, values)))


def beginning(data: Data, fit: Fit, share: float) -> Data:
    """The beginning of a test that holds a share of what a fit leaves; the whole test where that is long."""
    energy = np.cumsum(np.sum(np.square(fit.reduced), axis=1))
    groups = int(np.searchsorted(energy, share * energy[-1])) + 1
    least = round(SHORTEST / (data.system.plan.test.interval * data.group))
    groups = max(groups, least)
    if groups > LONGEST * data.groups or data.part.exact or isinstance(data.part, Building):
        return data
    return replace(data, part=data.part.first(groups * data.group), train=data.train[:groups])


def begun(fit: Fit) -> Fit:
    """A fit over the beginning of the test that holds most of what it leaves, nominal parameters moved back.

    Parameters that are far away stand in for an effect that is missing.
    """
    missed = float(np.max(np.mean(np.square(fit.reduced), axis=0)))
    z = np.zeros(fit.z.size) if missed > LOST else np.clip(fit.z, -NEAR, NEAR)
    return at(beginning(fit.data, fit, MOSTLY), fit.values, z)


def polished(found: Fit) -> Fit:
    """A fit that leaves something moved on to its end, from where it is and with its laws in their usual shape.

    Nominal parameters that stand in for what the effects had not reached yet begin near their plan's values again.
    """
    z = np.clip(found.z, -NEAR, NEAR)
    usual = {
        name: values
        | {item.name: item.default for item in found.data.catalogue[name].parameters if item.default}
        for name, values in found.values.items()
    }
    starts = [found.values, usual] if usual != found.values else [found.values]
    fits = each(lambda values: fit(found.data, values, z, POLISHED, rounds=3), starts)
    return min([found, *fits], key=lambda item: item.cost)


def at_end(fit: Fit) -> tuple[str, ...]:
    """Effects of a fit of which a parameter that is no shape lies at the end of what is believed of it.

    So do those of which a defining shape is least, and friction that hardly rests.
    """
    problem = Problem(fit.data, fit.values)
    low, high = problem.bounds()
    places = problem.place(fit.values, fit.z)
    edge = END * (high - low)
    least, most = places <= low + edge, places >= high - edge
    ended = [
        item.effect
        for item, below, above in zip(problem.frees, least[fit.z.size :], most[fit.z.size :], strict=True)
        if ((below or above) and not item.parameter.shape) or (below and item.parameter.defining)
    ]
    return (*ended, *without_rest(fit))


def without_rest(fit: Fit) -> tuple[str, ...]:
    """Friction of a fit that turns round over speeds so large that it is a drag, and no dry friction.

    Such a drag grows with the speed as a dashpot does, less and less, by whatever law.
    """
    return tuple(
        name
        for name, given in fit.values.items()
        for item in fit.data.catalogue[name].parameters
        if item.smoothing > 0.0 and given[item.name] > TURNS * item.most
    )
