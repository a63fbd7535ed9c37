"""Effects that a model of a specimen holds, fitted at once from its force over deformation."""

from __future__ import annotations

import numpy as np

from diagnosis.fits import fitting, hypothesis
from diagnosis.fits.fitting import Fit, excess
from diagnosis.fits.hypothesis import Values
from diagnosis.fits.laws.best import FITTED, MOST_LEFT, ROUGH, ROUNDS, cost, descended, fitted
from diagnosis.fits.laws.specimen import UNCRACKED, as_specimen, follow, path, within
from diagnosis.fits.threads import each
from diagnosis.fits.unexplained import leaves
from laboratories.effects.effect import Effect
from models.specimens.fit import SpecimenFit

# Of a force's rms that the best fit leaves: what a model of force over deformation leaves by itself, from which on its
# effects are fitted in the laboratory. That model knows no speed, which made up a quarter of the rest of a damper.
NEARLY = 1.5
# Of the force's rms: a second fault of an ordinary laboratory leaves less of a force than this, a specimen of another
# kind than the planned one left 9 to 30 %.
MUCH = 0.05
LONG = 20  # steps of such a fit
BEYOND = 2.0  # times the largest force measured: a slider's own one is passed on before it slides
TOGETHER = 2  # of such fits, those that are fitted to their end
STIFFNESS = "column.stiffness"  # stands beside a law with the planned stiffness where that is wrong
OTHERWISE = 1.25  # factor on the planned stiffness beyond which that effect stands beside a law of yielding


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
    found = follow(fit.data.part, way, models)
    starts = [
        (found[effect.laws[place].model].nrmse, beside(fit, effect, place, found[effect.laws[place].model]))
        for effect, place in places
        if effect.laws[place].model in found
    ]
    tried = {item.names for item in first}
    starts = [item for item in starts if item[0] < NEARLY * left and tuple(item[1]) not in tried]
    nearest = sorted(starts, key=lambda item: item[0])[:FITTED]
    begun = [fitting.at(fit.data, fit.values | values, np.zeros(fit.z.size)) for _, values in nearest]
    leading = sorted(begun, key=cost)[:TOGETHER]
    force = float(np.max(np.abs(way[1])))
    return sorted((item for item in moved_on(leading, best) if works(item, force)), key=cost)


def moved_on(starts: list[Fit], best: Fit) -> list[Fit]:
    """Fits from starts, each moved on as long as it may still leave no more than the best one known."""
    rough = each(lambda item: fitted(item, ROUGH, 1), starts)
    hopeful = [item for item in rough if excess(item) <= MOST_LEFT * excess(best)]
    done = each(lambda item: fitted(item, LONG, ROUNDS), hopeful)
    return each(lambda item: descended(item) if fitting.near(item, best) else item, done)


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
    planned = fit.data.system.plan.column.stiffness
    result = {effect.name: base | as_specimen(effect, law, strength, found.parameters, planned)}
    for own, renamed in law.beside.items():
        name = of_same_site(own, effect)
        other = catalogue[name]
        index = next(
            i for i, item in enumerate(other.laws) if set(item.shapes) <= set(renamed) and item.shapes
        )
        bounds = {item.name: item for item in other.every}
        given = {key: within(bounds[key], found.parameters[value]) for key, value in renamed.items()}
        result[name] = {"law": float(index)} | given
    if law.beside or UNCRACKED in law.shapes:
        return result
    factor = found.parameters["stiffness"] / planned
    stiffness = of_same_site(STIFFNESS, effect)
    if stiffness not in catalogue or 1.0 / OTHERWISE < factor < OTHERWISE:
        return result
    (parameter,) = catalogue[stiffness].parameters
    return {stiffness: {parameter.name: within(parameter, factor)}} | result


def of_same_site(name: str, effect: Effect) -> str:
    """The effect of that name, as a test with one column has it, at the site of another effect."""
    return f"{effect.site}.{name.rpartition('.')[2]}"
