"""Effects under all their laws from a grid of sizes and shapes, in the place of one that does not explain enough.

A search begins where effects look like straight lines of their size. One that bends where a motion is small may promise
nothing there, and one with more shapes follows it closely while nominal parameters make up for the rest. Nor does a fit
of the right effect find a shape that does nothing where it begins.
"""

from __future__ import annotations

from diagnosis.fits import fitting
from diagnosis.fits.fitting import TIED, Fit
from diagnosis.fits.laws.best import LEADING, ROUGH, ROUNDS, STEPS, cheapest, cost, descended, fitted
from diagnosis.fits.laws.starts import gridded
from diagnosis.fits.scales import Scales
from diagnosis.fits.screening import Plane
from diagnosis.fits.threads import each

HOPEFUL = 16  # of all laws, those that promise most at their best start, of which a fit is begun


def afresh(fit: Fit, scales: Scales) -> list[Fit]:
    """Fits with one effect, another or the same from elsewhere, of clearly lower costs, best first."""
    bare = fitting.at(fit.data, {}, fit.z)
    starts = [
        [{effect.name: values} for values in gridded(bare, effect, place, scales)]
        for effect in fit.data.part.candidates
        for place, law in enumerate(effect.laws)
        if not law.model
    ]
    laid = each(lambda grid: cheapest(bare, grid), [grid for grid in starts if grid])
    plane = Plane(bare)

    def promised(item: Fit) -> float:
        (name,) = item.names
        change = (item.reduced - bare.reduced).ravel()
        return plane.gain(change, scales.stretch(item.data.catalogue[name]))[0]

    hopeful = sorted(laid, key=promised, reverse=True)[:HOPEFUL]
    begun = each(lambda item: fitted(item, ROUGH, 1), hopeful)
    leading = each(lambda item: fitted(item, STEPS, ROUNDS), sorted(begun, key=cost)[:LEADING])
    ended = each(lambda item: descended(item) if fitting.near(item, fit) else item, leading)
    return sorted((item for item in ended if item.cost < fit.cost - TIED), key=cost)
