"""End stops: after each impact a wrong stop sends the prediction elsewhere, so fits grow with the test.

The first residual tells when the stop was first met, and the largest stroke until then where it stands; from there the
fit is lengthened bit by bit, each piece starting from the parameters of the shorter one. Under a further law only that
stiffness is lengthened which fits best shortly after the first contact. A stop that is met so lightly that the gap is
small sends no prediction elsewhere, and is fitted at once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from diagnosis.fits import fitting
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Values
from diagnosis.fits.laws.best import cost, simplest
from diagnosis.fits.residuals import Data
from diagnosis.fits.threads import each
from laboratories.effects.effect import Effect
from models.registry import Array

FIRST = 0.02  # of the largest residual, from which on the stop has been met
INSIDE = (0.97, 0.7)  # of the largest stroke before that, where a stiff and a soft stop may stand
LIGHTLY = (0.99, 0.96, 0.9, 0.8)  # of the largest stroke, where a stop may stand that is met lightly
NEAREST = 3  # of the starts of such a stop, those that are fitted,
ROUGH = 4  # so many steps; the best of them goes to its end
AFTER = 0.4  # s after first contact that the shortest fit covers
EARLY = 0.25  # of a test, after which the best start of each law goes on alone
LONGER = 1.3  # factor from one fit to the next
# Times the stroke before that: no motion that meets a stop goes so far, not even an unstable one.
BEYOND = 30.0
EVERY = 5  # of so many averaged samples one judges


class Begun(NamedTuple):
    """Where a fit over a piece of a test ended."""

    values: Values
    z: Array
    left: float  # what it costs, 0 where nothing was fitted


def touched(data: Data, fit: Fit, effect: Effect) -> Fit | None:
    """The fit with an end stop as well that is met lightly, so that no fit need grow; None without a recorded motion.

    The stop stands near the largest stroke, and is fitted from where it leaves least.
    """
    stop = effect.contact
    if stop is None or stop.motion not in data.part.signals:
        return None
    place = data.part.signals.index(stop.motion)
    there = data.part.present[:, place]
    if not there.any():
        return None
    reached = float(np.max(np.abs(data.part.measured[there, place])))
    springs = [
        {stop.place: share * reached, stop.stiffness: stiffness}
        for share in LIGHTLY
        for stiffness in stop.starts
    ]
    starts = [*springs, *(under for values in springs for under in further_laws(effect, values))]
    laid = each(lambda values: fitting.at(data, {**fit.values, effect.name: values}, fit.z), starts)
    nearest = sorted(laid, key=cost)[:NEAREST]
    rough = each(lambda item: fitting.fit(data, item.values, item.z, ROUGH, rounds=1), nearest)
    best = min(rough, key=cost)
    return fitting.fit(data, best.values, best.z)


def stopped(data: Data, fit: Fit, effect: Effect) -> Fit | None:
    """The fit with an end stop as well, None where the motion that meets it was not recorded, is none or goes on."""
    stop = effect.contact
    if stop is None or stop.motion not in data.part.signals:
        return None
    place = data.part.signals.index(stop.motion)
    if not data.part.present[:, place].any():
        return None
    bare = fitting.at(data, fit.values, np.zeros(fit.z.size))
    missed = np.max(np.abs(bare.reduced), axis=1)
    first = int(np.argmax(missed > FIRST * missed.max()))
    stroke = np.abs(data.part.measured[:, place])
    reached = float(np.max(stroke[: max(1, first * data.group)]))
    if reached <= 0.0 or float(np.nanmax(stroke)) > BEYOND * reached:
        return None
    groups = first + max(10, round(AFTER / (data.system.plan.test.interval * data.group)))
    starts = [
        {stop.place: share * reached, stop.stiffness: stiffness}
        for share in INSIDE
        for stiffness in stop.starts
    ]
    near = each(lambda start: beginning(data, fit, effect, start, groups), starts)
    count = len(stop.starts)
    kept = (min(near[place : place + count], key=cost) for place in range(0, len(near), count))
    best = [item.values[effect.name] for item in kept]
    further = [under for values in best for under in further_laws(effect, values)]
    begun = [{**fit.values, effect.name: dict(start)} for start in (*starts, *further)]
    early = [piece for piece in lengths(groups, data.groups) if piece <= EARLY * data.groups]
    met = each(lambda values: grown(data, values, np.zeros(fit.z.size), early), begun)
    ahead = best_of_laws(met, effect.name) if early else met
    late = lengths(groups, data.groups)[len(early) :]
    longer = each(lambda item: grown(data, item.values, item.z, late), ahead)
    fits = each(lambda item: fitting.fit(data, item.values, item.z, steps=6, rounds=2), longer)
    springs, others = by_law(fits, effect.name)
    return simplest(min(springs, key=cost), others)


def stop_of(fit: Fit) -> Effect | None:
    """The end stop among the effects of a fit."""
    effects = (fit.data.catalogue[name] for name in fit.names)
    return next((effect for effect in effects if effect.contact), None)


def vaguer(fit: Fit) -> Fit | None:
    """A fit with an end stop at its best by how well impacts are known; None without a stop, or where that is known.

    After an impact a simulation and a laboratory part, since the stop of the latter has another law. How far is told by
    how far two laws part that each fit best: from an impact on a sample counts by that.
    """
    effect, data = stop_of(fit), fit.data
    if effect is None or data.vague is not None or len(effect.laws) < 2:
        return None
    own = fit.values[effect.name]
    others = [
        effect.under(place, own) for place in range(len(effect.laws)) if place != int(own.get("law", 0))
    ]
    rest = [
        fitting.fit(data, fit.values | {effect.name: values}, fit.z, steps=6, rounds=1) for values in others
    ]
    stops = [fitting.at(data, fit.values | {effect.name: item.values[effect.name]}, fit.z) for item in rest]
    apart = np.max([np.abs(item.reduced - fit.reduced) for item in stops], axis=0)
    vague = np.sqrt(1.0 + np.square(np.maximum.accumulate(apart, axis=0)))
    return fitting.polished(fitting.at(replace(data, vague=vague), fit.values, fit.z))


def by_law(fits: Sequence[Fit], name: str) -> tuple[list[Fit], list[Fit]]:
    """The fits under the first law of an effect, and those under its others."""
    others = [item for item in fits if item.values[name].get("law")]
    return [item for item in fits if not item.values[name].get("law")], others


def further_laws(effect: Effect, values: Mapping[str, float]) -> list[dict[str, float]]:
    """Parameters of an end stop under each of its laws but the first, at the same place and as stiff."""
    return [{**effect.under(place, values), **values} for place in range(1, len(effect.laws))]


def beginning(data: Data, fit: Fit, effect: Effect, start: Mapping[str, float], groups: int) -> Fit:
    """One start, fitted over so many averaged samples."""
    values: Values = {**fit.values, effect.name: dict(start)}
    return shorter(data, values, np.zeros(fit.z.size), groups)


def lengths(groups: int, most: int) -> list[int]:
    """Averaged samples of ever longer pieces of a test of `most`, from so many on."""
    result = []
    while groups < most:
        result.append(groups)
        groups = int(LONGER * groups) + 1
    return result


def grown(data: Data, values: Values, z: Array, pieces: Sequence[int]) -> Begun:
    """Where fits over longer and longer pieces end, each from where the one before it did."""
    left = 0.0
    for groups in pieces:
        piece = shorter(data, values, z, groups)
        values, z, left = piece.values, piece.z, cost(piece)
    return Begun(values, z, left)


def best_of_laws(met: Sequence[Begun], name: str) -> list[Begun]:
    """Of fits over one piece the one of each law of an effect that leaves least, in the order of laws."""
    best: dict[float, Begun] = {}
    for item in sorted(met, key=lambda item: item.left):
        best.setdefault(item.values[name].get("law", 0.0), item)
    return [best[law] for law in sorted(best)]


def shorter(data: Data, values: Values, z: Array, groups: int) -> Fit:
    """A fit over the first averaged samples, of which some are withheld."""
    piece = replace(
        data, part=data.part.first(groups * data.group), train=np.arange(groups) % EVERY < EVERY - 1
    )
    return fitting.fit(piece, values, z, steps=6, rounds=1)
