"""A mechanism that has several laws: the one that fits best stands for it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache

import numpy as np
from scipy.optimize import minimize

from common.plan.kinds import COLUMN
from diagnosis.fits import fitting, hypothesis
from diagnosis.fits.fitting import Fit, excess
from diagnosis.fits.hypothesis import Problem, Values
from diagnosis.fits.scales import Scales
from diagnosis.fits.screening import WORKERS, Plane, ScreenedEffect
from diagnosis.fits.unexplained import leaves, remaining
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.parts import ColumnAlone, LaboratoryPart, Part
from laboratories.effects.effect import Effect, Law, Parameter
from models.registry import Array
from models.specimens import fit as specimens
from models.specimens.fit import SpecimenFit

# Where a column stands once it has yielded hangs on all before, so that a fit from afar ends nowhere: it starts from
# what follows the measured force over the measured deformation best, or else starts are dense.
NEARER = np.geomspace(0.5, 1.3, 10)  # times the strength found under another law
FINER = (0.0, 0.5, 1.5)  # times the sizes of the first shape that a law has, beside these
REACHED = (0.15, 0.3, 0.5, 0.75)  # of the largest deformation: where a bend is looked for
FITTED = 4  # of an effect's laws, those with the best starts
ROUGH = 3  # steps of a first fit, after which laws are held against each other
LEADING = 4  # of all laws, those that are fitted to their end
STEPS, ROUNDS = 8, 2  # of such a fit
TURNS, EVALUATIONS = 2, 60  # of the simplex with the effects' parameters, each followed by a fit of all
LOGARITHMIC, LINEAR = 0.06, 0.4  # first edges of the simplex, of the logarithm and of a shape over its size
SURELY = 25.0  # cost by which another law must be better: 5 standard deviations squared
FARTHEST = 30.0  # times what the best fit leaves: one that leaves more is under no law the right one
SLIGHT = (
    0.02  # systematic residual over noise below which one law is as good as another: it can hardly be seen
)
# Of a force's rms that the best fit leaves: what a model of force over deformation leaves by itself, from which on its
# effects are fitted in the laboratory. That model knows no speed, which made up a quarter of the rest of a damper.
NEARLY = 1.5
# Of the force's rms: a second fault of an ordinary laboratory leaves less of a force than this, a specimen of another
# kind than the planned one left 9 to 30 %.
MUCH = 0.05
LONG = 20  # steps of such a fit
BEYOND = 2.0  # times the largest force measured: a slider's own one is passed on before it slides
WEAKER, GRID = 0.25, 8  # times the least size of a search: where a grid over the sizes begins, and its points
TOGETHER = 2  # of such fits, those that are fitted to their end
STIFFNESS = "column.stiffness"  # what a law with the planned stiffness has beside it where that is wrong
OTHERWISE = 1.25  # factor on the planned stiffness beyond which a law of yielding does not find its own way
# Over the secant of the whole column: a spring that gives way by a tenth of the motion, between one that bends it and
# one that is not seen, and softer ones, which a part beside the column may have.
STIFFNESSES = (0.1, 1.0, 10.0)
BETTER = 0.9  # of what is left beyond noise: less of it is worth another law than the first


def in_best_laws(fits: list[Fit]) -> list[Fit]:
    """The fits, best first, with the effect that came last under that law of its mechanism that leaves least.

    Nothing is tried where the best fit leaves too little to be seen. The best one is first fitted to its end under its
    own law: another law would else explain what that fit has not reached yet.
    """
    if not fits or remaining(fits[0]) < SLIGHT:
        return fits
    if len(last(fits[0]).laws) > 1:
        fits = sorted([fitting.polished(fits[0]), *fits[1:]], key=cost)
        if remaining(fits[0]) < SLIGHT:
            return fits
    others = raced([item for item in fits if excess(item) <= FARTHEST * excess(fits[0])])
    better = sorted((others.get(item.names[-1], item) for item in fits), key=cost)
    return ending(better, fits)


def ending(better: list[Fit], fits: list[Fit]) -> list[Fit]:
    """Fits, best first, with those that lead under another law than in `fits` moved to the bottom of their valley."""
    done: list[Fit] = []
    while better and not any(better[0] is item for item in (*fits, *done)):
        done.append(settled(better[0]))
        better = sorted([done[-1], *better[1:]], key=cost)
    return better


def raced(fits: list[Fit], most: float = math.inf) -> dict[str, Fit]:
    """The fits whose last effect leaves less under another law than the first, by that effect.

    The laws of all effects are fitted for a few steps, and those that then lead to their end, unless they leave more
    than `most` or far more than the best of the fits.
    """
    firsts = {item.names[-1]: item for item in reversed(fits)}
    starts = [start for item in firsts.values() for start in begun(item)]
    most = min(most, FARTHEST * min(map(excess, fits)))
    found: dict[str, list[Fit]] = {}
    with ThreadPoolExecutor(WORKERS) as pool:
        rough = sorted(pool.map(lambda start: fitted(start, ROUGH, 1), starts), key=cost)
        leading = [item for item in rough[:LEADING] if excess(item) <= most]
        for item in pool.map(lambda item: fitted(item, STEPS, ROUNDS), leading):
            found.setdefault(item.names[-1], []).append(item)
    chosen = {name: simplest(firsts[name], others) for name, others in found.items()}
    return {name: item for name, item in chosen.items() if item is not firsts[name]}


def fitted(start: Fit, steps: int, rounds: int) -> Fit:
    """A fit moved on by a few steps."""
    return fitting.fit(start.data, start.values, start.z, steps, rounds=rounds)


def simplest(first: Fit, others: list[Fit]) -> Fit:
    """The first fit, or one under another law: with more free parameters only where it is much better."""
    best = first
    for item in sorted(others, key=lambda item: len(Problem(item.data, item.values).frees)):
        if item.cost < best.cost - SURELY and excess(item) < BETTER * excess(best):
            best = item
    return best


def begun(fit: Fit) -> list[Fit]:
    """The fit with its last effect under further laws, where a fit of each starts best: those with the best starts."""
    way = path(fit.data.part)
    models = sorted({law.model for law in last(fit).laws[1:] if law.model}) if way is not None else []
    known = tuple(item.tobytes() for item in way) if way is not None else ()
    followed = {model: following(model, *known).parameters for model in models}
    places = range(1, len(last(fit).laws))
    return sorted((begun_under(fit, place, followed) for place in places), key=cost)[:FITTED]


@lru_cache(maxsize=32)
def following(model: str, deformation: bytes, force: bytes) -> SpecimenFit:
    """A model of a specimen fitted to a path of deformation (m) and force (N); a search asks for it more than once."""
    return specimens.fit(model, np.frombuffer(deformation), np.frombuffer(force))


def last(fit: Fit) -> Effect:
    """The effect of a fit that came last."""
    return fit.data.catalogue[fit.names[-1]]


def cost(fit: Fit) -> float:
    """The figure by which fits are ranked."""
    return fit.cost


def settled(fit: Fit) -> Fit:
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


def begun_under(fit: Fit, place: int, followed: Mapping[str, Mapping[str, float]]) -> Fit:
    """The fit with its last effect under the law at a place of its laws, where a fit of it starts best.

    From the plan's parameters, as those of a fit under a wrong law mean nothing. `followed` are the parameters with
    which models of specimens follow the measured path, by model.
    """
    effect = last(fit)
    begun = (
        fitting.at(fit.data, fit.values | {effect.name: values}, np.zeros(fit.z.size))
        for values in starts(fit, effect, place, followed)
    )
    return min(begun, key=cost)


def starts(
    fit: Fit, effect: Effect, place: int, followed: Mapping[str, Mapping[str, float]]
) -> Iterator[dict[str, float]]:
    """Parameters from which a law may start: of the specimen that it is, or near those under another law."""
    base, law = effect.under(place, fit.values[effect.name]), effect.laws[place]
    (strength,) = (item for item in effect.parameters if not item.shape)
    if law.model in followed:
        yield base | as_specimen(effect, law, strength, followed[law.model])
        return
    ways = itertools.product(NEARER.tolist(), shapes(fit, effect, place), stiff(fit, effect, law))
    for share, shape, spring in ways:
        yield base | shape | spring | {strength.name: within(strength, share * base[strength.name])}


def unlike_first(fit: Fit, scales: Scales) -> list[ScreenedEffect]:
    """What effects promise over a fit under laws behind their first, best first.

    Each is laid at a grid of starts: play behind a loop looks like no size of play before it, and what it does is no
    straight line in its parameters. Models of specimens are left out, which follow force over deformation.
    """
    plane = Plane(fit)
    ways = [
        (effect, place)
        for effect in fit.data.part.candidates
        for place, law in enumerate(effect.laws)
        if place and not law.model and effect.name not in fit.names
    ]

    def promised(effect: Effect, values: dict[str, float]) -> ScreenedEffect:
        change = (
            fitting.at(fit.data, fit.values | {effect.name: values}, fit.z).reduced - fit.reduced
        ).ravel()
        gain, _, z = plane.gain(change, scales.stretch(effect))
        return ScreenedEffect(effect, values, z, gain)

    def best(way: tuple[Effect, int]) -> list[ScreenedEffect]:
        found = [promised(way[0], values) for values in gridded(fit, *way, scales)]
        return sorted(found, key=lambda item: -item.gain)[:1]

    with ThreadPoolExecutor(WORKERS) as pool:
        found = [item for items in pool.map(best, ways) for item in items]
    return sorted(found, key=lambda item: -item.gain)


def gridded(fit: Fit, effect: Effect, place: int, scales: Scales) -> Iterator[dict[str, float]]:
    """Parameters from which a law may start where nothing is known of its effect, from weak to strong."""
    (strength,) = (item for item in effect.parameters if not item.shape)
    sizes = [values[strength.name] for _, values in scales.starts(effect)]
    if not sizes or min(sizes) <= 0.0:
        return
    for size in np.geomspace(WEAKER * min(sizes), max(sizes), GRID).tolist():
        base = effect.under(place, effect.values({strength.name: within(strength, size)}))
        for shape in shapes(fit, effect, place):
            yield base | shape


def as_specimen(
    effect: Effect, law: Law, strength: Parameter, found: Mapping[str, float]
) -> dict[str, float]:
    """The parameters of an effect under a law from those of the specimen that it is."""
    known = {item.name: item for item in effect.every}
    values = dict(found)
    if "first_bend" in values.keys() - law.shapes.keys():  # without it the law yields at the same force
        bend = values["first_bend"]
        values["yield_displacement"] *= bend + values["second_stiffness"] * (1.0 - bend)
    if "push" in values:
        push, pull = values["push"], values["pull"]
        values |= {"force": 0.5 * (push + pull), "asymmetry": (push - pull) / (push + pull)}
    names = (strength.name, *law.shapes)
    return {
        name: within(known[name], values.get(law.renamed.get(name, name), law.shapes.get(name, 0.0)))
        for name in names
    }


def coupled(fit: Fit, first: list[Fit]) -> list[Fit]:
    """Fits with the effects that one model of a specimen holds, beside those with one effect, `first`, best first.

    They are a slider behind play, and a law of yielding whose first stiffness is not the planned one. One by one such
    effects explain little, so that a search does not reach them: without its play a slider reverses too early. Nor
    does it reach yielding where its first law is far from the specimen's. They are tried where much of the force is
    left and more than noise, and where the model follows the measured force about as well as the best fit known, or
    better.
    """
    way, best = path(fit.data.part), first[0]
    if way is None or not leaves(best):
        return []
    residual = best.data.residual(hypothesis.lay(best.data, best.z, best.values))[:, -1]  # of the force
    left = float(np.sqrt(np.mean(np.square(residual)) / np.mean(np.square(way[1]))))
    if left < MUCH:
        return []
    places = [
        (effect, place)
        for effect in fit.data.part.candidates
        for place, law in enumerate(effect.laws)
        if law.model and effect.name not in fit.names
    ]
    models = sorted({effect.laws[place].model for effect, place in places})
    found = {model: following(model, *(item.tobytes() for item in way)) for model in models}
    starts = [
        (found[effect.laws[place].model].nrmse, beside(fit, effect, place, found[effect.laws[place].model]))
        for effect, place in places
    ]
    tried = {item.names for item in first}
    starts = [item for item in starts if item[0] < NEARLY * left and tuple(item[1]) not in tried]
    known = sorted(starts, key=lambda item: item[0])
    begun = [fitting.at(fit.data, fit.values | values, np.zeros(fit.z.size)) for _, values in known[:FITTED]]
    leading = sorted(begun, key=cost)[:TOGETHER]
    done = (settled(fitted(item, LONG, ROUNDS)) for item in leading)
    return sorted((item for item in done if works(item, float(np.max(np.abs(way[1]))))), key=cost)


def works(fit: Fit, force: float) -> bool:
    """Whether all forces that effects of a fit need to act lie within `BEYOND` times the largest one measured, N.

    A slider that never slides is a spring, which stands in for what bends.
    """
    catalogue = fit.data.catalogue
    forces = [
        values[item.name]
        for name, values in fit.values.items()
        for item in catalogue[name].parameters
        if item.unit == "N" and not item.shape and item.null == 0.0
    ]
    return all(abs(value) <= BEYOND * force for value in forces)


def beside(fit: Fit, effect: Effect, place: int, found: SpecimenFit) -> Values:
    """An effect under a law and what its model holds beside it, from that model's parameters."""
    catalogue, law = fit.data.catalogue, effect.laws[place]
    (strength,) = (item for item in effect.parameters if not item.shape)
    base = effect.under(place, effect.values({strength.name: 0.0}))
    result = {effect.name: base | as_specimen(effect, law, strength, found.parameters)}
    for name, renamed in law.beside.items():
        other = catalogue[name]
        index = next(
            i for i, item in enumerate(other.laws) if set(item.shapes) <= set(renamed) and item.shapes
        )
        bounds = {item.name: item for item in other.every}
        given = {key: within(bounds[key], found.parameters[value]) for key, value in renamed.items()}
        result[name] = {"law": float(index)} | given
    if law.beside:
        return result
    factor = found.parameters["stiffness"] / fit.data.system.plan.column.stiffness
    if STIFFNESS not in catalogue or 1.0 / OTHERWISE < factor < OTHERWISE:
        return result
    (parameter,) = catalogue[STIFFNESS].parameters
    return {STIFFNESS: {parameter.name: within(parameter, factor)}} | result


def stiff(fit: Fit, effect: Effect, law: Law) -> list[dict[str, float]]:
    """A stiffness that only this law has, at `STIFFNESSES` times the largest force over the largest deformation."""
    way = path(fit.data.part)
    names = [item for item in effect.further if item.name in law.shapes and item.unit == "N/m"]
    if way is None or not names:
        return [{}]
    secant = float(np.max(np.abs(way[1])) / np.max(np.abs(way[0])))
    return [{item.name: within(item, share * secant) for item in names} for share in STIFFNESSES]


def shapes(fit: Fit, effect: Effect, place: int) -> list[dict[str, float]]:
    """The first shape of a law at some sizes: a length that only some laws have follows what the column reaches.

    A second length of the law stays in proportion to it.
    """
    law = effect.laws[place]
    shape = next((item for item in effect.every if item.name in law.shapes and item.sizes), None)
    if shape is None:
        return [{}]
    way = path(fit.data.part)
    if shape in effect.further and way is not None:
        sizes = {share * float(np.max(np.abs(way[0]))) for share in REACHED}
    else:
        sizes = {share * size for share in (*FINER, 1.0) for size in shape.sizes}
    lengths = [item for item in effect.further if item.name in law.shapes and item.unit == shape.unit == "m"]
    scaled = {item: law.shapes[item.name] / law.shapes[shape.name] for item in lengths if item is not shape}
    return [
        {shape.name: within(shape, size)}
        | {item.name: within(item, ratio * size) for item, ratio in scaled.items()}
        for size in sorted(sizes)
    ]


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
