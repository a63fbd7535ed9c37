"""Effects whose first law promises nothing, looked at under their further laws."""

from __future__ import annotations

import math

from diagnosis.fits import fitting
from diagnosis.fits.fitting import Fit
from diagnosis.fits.laws.starts import gridded
from diagnosis.fits.scales import Scales
from diagnosis.fits.screening import Plane, ScreenedEffect
from diagnosis.fits.threads import each
from laboratories.effects.effect import Effect


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
        gain, share, z = plane.gain(change, scales.stretch(effect))
        start = scales.stretched(
            effect, values, math.copysign(1.0, share)
        )  # as large, to the side that promises
        return ScreenedEffect(effect, start, z, gain)

    def best(way: tuple[Effect, int]) -> list[ScreenedEffect]:
        found = [promised(way[0], values) for values in gridded(fit, *way, scales)]
        return sorted(found, key=lambda item: -item.gain)[:1]

    found = [item for items in each(best, ways) for item in items]
    return sorted(found, key=lambda item: -item.gain)
