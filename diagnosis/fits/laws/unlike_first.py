"""Effects whose first law promises nothing, looked at under their further laws."""

from __future__ import annotations

import math

from diagnosis.fits import fitting
from diagnosis.fits.fitting import Fit
from diagnosis.fits.laws.starts import gridded
from diagnosis.fits.scales import Scales
from diagnosis.fits.screening import FARTHER, Plane, ScreenedEffect
from diagnosis.fits.threads import each
from laboratories.effects.effect import Effect

MUCH_SMALLER = 0.25  # share of a start, below which fits from there take many steps: they end after a few
# Times as long as such a beginning must be all that a fit covers, for it to be worth its own slopes.
FULLER = 2
LAID = 2  # of the starts of a law over such a beginning, those that are looked at over all
AS_MUCH = 0.9  # of what a start promises: what it does is no straight line if a smaller one promises less


def unlike_first(fit: Fit, scales: Scales) -> list[ScreenedEffect]:
    """What effects promise over a fit under laws behind their first, best first.

    Each is laid at a grid of starts: play behind a loop looks like no size of play before it, and what it does is no
    straight line in its parameters. Where a beginning is a small part of all, most starts are compared over it alone.
    Where what an effect does nearly is a straight line, as of friction that is far weaker than any usual one, the start
    goes along that line as long as it promises no less. Models of specimens are left out, which follow force over
    deformation.
    """
    plane = Plane(fit)
    short = fitting.beginning(fit.data, fit, fitting.BRIEFLY)
    few = short.groups * FULLER > fit.data.groups
    brief = plane if few else Plane(fitting.at(short, fit.values, fit.z))
    ways = [
        (effect, place)
        for effect in fit.data.part.candidates
        for place, law in enumerate(effect.laws)
        if place and not law.model and effect.name not in fit.names
    ]

    def promised(
        effect: Effect, values: dict[str, float], plane: Plane = plane
    ) -> tuple[ScreenedEffect, float]:
        over = plane.fit
        change = fitting.at(over.data, over.values | {effect.name: values}, over.z).reduced - over.reduced
        gain, share, z = plane.gain(change.ravel(), scales.stretch(effect))
        start = scales.stretched(
            effect, values, math.copysign(1.0, share)
        )  # as large, to the side that promises
        return ScreenedEffect(effect, start, z, gain), share

    def smaller(found: ScreenedEffect, share: float) -> ScreenedEffect:
        for _ in range(FARTHER):
            if not 0.0 < abs(share) < MUCH_SMALLER:
                break
            nearer, share = promised(found.effect, scales.stretched(found.effect, found.values, abs(share)))
            if nearer.gain < AS_MUCH * found.gain:
                break
            found = nearer
        return found

    def best(way: tuple[Effect, int]) -> list[ScreenedEffect]:
        starts = list(gridded(fit, *way, scales))
        if brief is not plane and len(starts) > LAID:
            starts.sort(key=lambda values: -promised(way[0], values, brief)[0].gain)
            del starts[LAID:]
        found = [promised(way[0], values) for values in starts]
        return [smaller(*item) for item in sorted(found, key=lambda item: -item[0].gain)[:1]]

    found = [item for items in each(best, ways) for item in items]
    return sorted(found, key=lambda item: -item.gain)
