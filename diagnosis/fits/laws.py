"""A mechanism that has several laws: the one that fits best stands for it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from scipy.optimize import minimize

from common.plan.kinds import COLUMN
from diagnosis.fits import fitting
from diagnosis.fits.fitting import Fit, Problem, excess
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.parts import ColumnAlone, LaboratoryPart, Part
from laboratories.effects.effect import Effect, Parameter
from models.registry import Array
from models.specimens import fit as specimens

# Where a column stands once it has yielded hangs on all before, so that a fit from afar ends nowhere: it starts from
# what follows the measured force over the measured deformation best, or else starts are dense.
NEARER = np.geomspace(0.5, 1.3, 10)  # times the strength found under another law
FINER = (0.0, 0.5, 1.5)  # times the sizes of the first shape that a law has, beside these
REACHED = (0.15, 0.3, 0.5, 0.75)  # of the largest deformation: where a bend is looked for
FITTED = 4  # of the laws, those with the best starts
STEPS, ROUNDS = 8, 2  # of a fit
TURNS, EVALUATIONS = 2, 60  # of the simplex with the effects' parameters, each followed by a fit of all
LOGARITHMIC, LINEAR = 0.06, 0.4  # first edges of the simplex, of the logarithm and of a shape over its size
SURELY = 25.0  # cost by which another law must be better: 5 standard deviations squared
BETTER = 0.9  # of what is left beyond noise: less of it is worth another law than the first


def in_best_law(fit: Fit) -> Fit:
    """The fit with its last effect under the law that leaves least; the first one where none is much better."""
    effect = fit.data.catalogue[fit.names[-1]]
    begun = [begun_under(fit, effect, place) for place in range(1, len(effect.laws))]
    begun = sorted(begun, key=lambda item: item.cost)[:FITTED]
    best = fit
    for start in sorted(begun, key=lambda item: len(Problem(item.data, item.values).frees)):
        found = fitting.fit(fit.data, start.values, start.z, STEPS, rounds=ROUNDS)
        surely = found.cost < best.cost - SURELY
        best = found if surely and excess(found) < BETTER * excess(best) else best
    return best if best is fit else settled(best)


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


def begun_under(fit: Fit, effect: Effect, place: int) -> Fit:
    """The fit with an effect under the law at a place of its laws, where a fit of it starts best.

    From the plan's parameters, as those of a fit under a wrong law mean nothing.
    """
    begun = (
        fitting.at(fit.data, fit.values | {effect.name: values}, np.zeros(fit.z.size))
        for values in starts(fit, effect, place)
    )
    return min(begun, key=lambda item: item.cost)


def starts(fit: Fit, effect: Effect, place: int) -> Iterator[dict[str, float]]:
    """Parameters from which a law may start: of the specimen that it is, or near those under another law."""
    base, law = effect.under(place, fit.values[effect.name]), effect.laws[place]
    (strength,) = (item for item in effect.parameters if not item.shape)
    way = path(fit.data.part) if law.model else None
    if way is not None:
        found = specimens.fit(law.model, *way).parameters
        known = {item.name: item for item in effect.every}
        if "first_bend" in found.keys() - law.shapes.keys():  # without it the law yields at the same force
            bend = found["first_bend"]
            found["yield_displacement"] *= bend + found["second_stiffness"] * (1.0 - bend)
        for name in (strength.name, *law.shapes):
            base[name] = within(known[name], found[law.renamed.get(name, name)])
        yield base
        return
    for share, shape in itertools.product(NEARER.tolist(), shapes(fit, effect, place)):
        yield base | shape | {strength.name: within(strength, share * base[strength.name])}


def shapes(fit: Fit, effect: Effect, place: int) -> list[dict[str, float]]:
    """The first shape of a law at some sizes: a length that only some laws have follows what the column reaches."""
    law = effect.laws[place]
    shape = next((item for item in effect.every if item.name in law.shapes and item.sizes), None)
    if shape is None:
        return [{}]
    way = path(fit.data.part)
    if shape in effect.further and way is not None:
        sizes = {share * float(np.max(np.abs(way[0]))) for share in REACHED}
    else:
        sizes = {share * size for share in (*FINER, 1.0) for size in shape.sizes}
    return [{shape.name: within(shape, size)} for size in sorted(sizes)]


def within(parameter: Parameter, value: float) -> float:
    """A value within a parameter's bounds."""
    return min(max(value, parameter.least), parameter.most)


def path(part: Part) -> tuple[Array, Array] | None:
    """Measured deformation (m) and force (N) of a part's column, where both are there; None where there is none.

    Of several recordings those of the one that goes farthest.
    """
    if isinstance(part, JoinedPart):
        ways = [way for piece in part.pieces if (way := path(piece)) is not None]
        return max(ways, key=lambda way: float(np.max(np.abs(way[0]))), default=None)
    if isinstance(part, ColumnAlone):
        there, deformation, force = part.present[:, 0], part.inputs, part.measured[:, 0]
    elif isinstance(part, LaboratoryPart) and part.lab.kind.name == COLUMN:
        there, (deformation, force) = np.all(part.present, axis=1), part.measured.T
    else:
        return None
    if not (np.any(deformation[there]) and np.any(force[there])):
        return None
    return deformation[there], force[there]
