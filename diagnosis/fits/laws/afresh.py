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
from diagnosis.fits.threads import each


def afresh(fit: Fit, scales: Scales) -> list[Fit]:
    """Fits with one effect, another or the same from elsewhere, of clearly lower costs, best first."""
    bare = fitting.at(fit.data, {}, fit.z)
    starts = [
        [{effect.name: values} for values in gridded(bare, effect, place, scales)]
        for effect in fit.data.part.candidates
        for place, law in enumerate(effect.laws)
        if not law.model
    ]
    begun = each(lambda grid: fitted(cheapest(bare, grid), ROUGH, 1), [grid for grid in starts if grid])
    leading = each(lambda item: fitted(item, STEPS, ROUNDS), sorted(begun, key=cost)[:LEADING])
    ended = each(lambda item: descended(item) if fitting.near(item, fit) else item, leading)
    return sorted((item for item in ended if item.cost < fit.cost - TIED), key=cost)
