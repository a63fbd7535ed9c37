"""Parameters from which a fit of a law starts.

Where a column stands once it has yielded hangs on all before, so that a fit from afar ends nowhere: it starts from what
follows the measured force over the measured deformation best, or else starts are dense.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping

import numpy as np

from diagnosis.fits.fitting import Fit
from diagnosis.fits.laws.specimen import as_specimen, path, within
from diagnosis.fits.scales import Scales
from laboratories.effects.effect import Effect, Law

NEARER = np.geomspace(0.5, 1.3, 10)  # times the strength found under another law
FINER = (0.0, 0.5, 1.5)  # times the sizes of the first shape that a law has, beside these
REACHED = (0.15, 0.3, 0.5, 0.75)  # of the largest deformation: where a bend is looked for
WEAKER, GRID = 0.25, 8  # times the least size of a search: where a grid over the sizes begins, and its points
# Times the largest size of a search: a level that a law nears gradually is felt far below it, by (peak/level)ⁿ/n, which
# is 0.5 % at 4 times the peak with n = 3.
ABOVE = 4.0
# Over the secant of the whole column: a spring that gives way by a tenth of the motion, between one that bends it and
# one that is not seen, and softer ones, which a part beside the column may have.
STIFFNESSES = (0.1, 1.0, 10.0)


def starts(
    fit: Fit, effect: Effect, place: int, followed: Mapping[str, Mapping[str, float]]
) -> Iterator[dict[str, float]]:
    """Parameters from which a law may start: of the specimen that it is, or near those under another law."""
    base, law = effect.under(place, fit.values[effect.name]), effect.laws[place]
    (strength,) = (item for item in effect.parameters if not item.shape)
    if law.model in followed:
        planned = fit.data.system.plan.column.stiffness
        yield base | as_specimen(effect, law, strength, followed[law.model], planned)
        return
    ways = itertools.product(NEARER.tolist(), shapes(fit, effect, place), stiff(fit, effect, law))
    for share, shape, spring in ways:
        yield base | shape | spring | {strength.name: within(strength, share * base[strength.name])}


def gridded(fit: Fit, effect: Effect, place: int, scales: Scales) -> Iterator[dict[str, float]]:
    """Parameters from which a law may start where nothing is known of its effect, from weak to strong."""
    (strength,) = (item for item in effect.parameters if not item.shape)
    sizes = scales.sizes(effect, strength)
    if not sizes or min(sizes) <= 0.0:
        return
    most = max(sizes) * (ABOVE if strength.bends_by else 1.0)
    for size in np.geomspace(WEAKER * min(sizes), most, GRID).tolist():
        base = effect.under(place, effect.values({strength.name: within(strength, size)}))
        for shape in shapes(fit, effect, place, finer=()):
            yield base | shape


def shapes(fit: Fit, effect: Effect, place: int, finer: tuple[float, ...] = FINER) -> list[dict[str, float]]:
    """The first shape of a law at its sizes, and at these times `finer`.

    A length that only some laws have follows what the column reaches. A second length of the law stays in proportion.
    """
    law = effect.laws[place]
    shape = next((item for item in effect.every if item.name in law.shapes and item.sizes), None)
    if shape is None:
        return [{}]
    way = path(fit.data.part)
    if shape in effect.further and way is not None and shape.unit == "m":
        sizes = {share * float(np.max(np.abs(way[0]))) for share in REACHED}
    elif shape in effect.further and way is not None and shape.unit == "N":
        sizes = {float(np.max(np.abs(way[1]))) / share for share in REACHED}
    else:
        sizes = {share * size for share in (*finer, 1.0) for size in shape.sizes}
    lengths = [item for item in effect.further if item.name in law.shapes and item.unit == shape.unit == "m"]
    scaled = {item: law.shapes[item.name] / law.shapes[shape.name] for item in lengths if item is not shape}
    return [
        {shape.name: within(shape, size)}
        | {item.name: within(item, ratio * size) for item, ratio in scaled.items()}
        for size in sorted(sizes)
    ]


def stiff(fit: Fit, effect: Effect, law: Law) -> list[dict[str, float]]:
    """A stiffness that only this law has, at `STIFFNESSES` times the largest force over the largest deformation."""
    way = path(fit.data.part)
    names = [item for item in effect.further if item.name in law.shapes and item.unit == "N/m"]
    if way is None or not names:
        return [{}]
    secant = float(np.max(np.abs(way[1])) / np.max(np.abs(way[0])))
    return [{item.name: within(item, share * secant) for item in names} for share in STIFFNESSES]
