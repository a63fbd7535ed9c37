"""The servo loop of a shaking table found as a whole, from its frequency response.

A real loop is rarely one of second order: velocity and acceleration are fed forward, oil and what stands on the
platform swing. One by one such parts explain little where the loop of the plan is far away, and their sizes hang on
each other, so that a search which adds one effect after another ends with two that stand in for all. In the frequency
response each of them has a place of its own, and a fit of all of them takes as long as a few replays.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from common.plan.kinds import TABLE
from diagnosis.fits import fitting, worth
from diagnosis.fits.fitting import Fit, excess
from diagnosis.fits.hypothesis import Values, lay
from diagnosis.fits.laws.best import BETTER, frees
from diagnosis.fits.laws.loop_response import LoopResponse, places_read
from diagnosis.fits.residuals import Data
from diagnosis.fits.screening import Plane
from diagnosis.fits.threads import unshared
from diagnosis.fits.unexplained import leaves
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.parts import LaboratoryPart, Part
from laboratories.effects.effect import Effect
from models.registry import Array

AS_ONE = 3  # effects of a loop beyond which they were found together, and count as one
MUCH = 0.05  # of a reading's rms: a second fault of an ordinary laboratory leaves less of it
ROUGH, STEPS, ROUNDS = 6, 30, 2  # of a fit to spectra: steps of a first one, and of one to its end
LONG = 20  # steps of a fit to the readings
APART = 1.12  # one frequency of a resonance over the one before it, where it is looked for


def of_one_loop(fit: Fit) -> tuple[str, ...]:
    """The effects of a fit that were found together as one loop, of which none is exchanged for another by itself."""
    parts = tuple(name for name in fit.names if fit.data.catalogue[name].of_loop)
    return parts if len(parts) > AS_ONE else ()


def single(fit: Fit) -> tuple[str, ...]:
    """The effects of a fit that were found one by one."""
    whole = of_one_loop(fit)
    return tuple(name for name in fit.names if name not in whole)


def whole_loops(bare: Fit, first: Sequence[Fit]) -> list[Fit]:
    """A fit with all parts of a table's loop that its frequency response shows, beside those with one effect, `first`.

    It is tried where the best of these, which comes first, leaves much of a reading, and kept where it leaves less than
    half of that.
    """
    part, best = table_of(bare.data.part), first[0]
    if part is None or not leaves(best) or missed(best) < MUCH:
        return []
    with unshared():
        seen = shed(grown(response(bare.data, part)))
    if len(seen.names) < 2:
        return []
    found = fitting.fit(bare.data, seen.values | zeros(bare, seen.data.part.signals), seen.z, LONG)
    found = fitting.fit(bare.data, moving(found), found.z, LONG)
    return [found] if excess(found) < worth.HALF * excess(best) else []


def table_of(part: Part) -> LaboratoryPart | None:
    """The table of a part, of several recordings in the one that moves most.

    None where there is none with a loop, or nothing of the table was read.
    """
    if isinstance(part, JoinedPart):
        tables = [one for piece in part.pieces if (one := table_of(piece)) is not None]
        return max(tables, key=lambda one: float(np.ptp(next(iter(one.inputs.values())))), default=None)
    if not isinstance(part, LaboratoryPart) or part.lab.kind.name != TABLE:
        return None
    driven = bool(places_read(part)) and np.ptp(next(iter(part.inputs.values()))) > 0.0
    return part if driven and math.isfinite(part.lab.plan.table.frequency) else None


def missed(fit: Fit) -> float:
    """The largest share of a reading's rms that a fit leaves."""
    rest = np.sqrt(np.mean(np.square(fit.reduced), axis=0)) * fit.data.sigma / math.sqrt(fit.data.group)
    level = fit.data.part.level
    return float(np.max(np.divide(rest, level, out=np.zeros_like(rest), where=level > 0.0)))


def response(data: Data, part: LaboratoryPart) -> Data:
    """The readings of a table as spectra, in the form that fits use; nothing is withheld."""
    spectra = LoopResponse(part, data.system.plan.test.interval)
    places = [data.part.signals.index(name) for name in spectra.signals]
    lines = np.ones(len(spectra.measured), dtype=bool)
    none = np.zeros(len(places))
    return Data(spectra, data.system, data.sigma[places], data.white[places], 1, lines, none, data.catalogue)


def grown(data: Data) -> Fit:
    """A fit to spectra with the values that the plan has of a loop, and each further part that pays.

    A loop with feed-forward follows its command as a quick one does, beside which nothing more pays. So a fit begins
    from these values alone, and once more with the part that leaves least near the plan.
    """
    parts = [effect for effect in data.part.candidates if effect.of_loop]
    own = {effect.name: effect.values(nearest(effect)) for effect in parts if not effect.laws}
    planned = fitting.at(data, own, np.zeros(len(data.part.nuisances)))
    further = [effect for effect in parts if effect.laws]
    first = min(with_one(planned, further), key=left)
    begun = [spectral(data, item.values, item.z) for item in (planned, first)]
    return min((extended(item, further) for item in begun), key=paid)


def extended(found: Fit, further: Sequence[Effect]) -> Fit:
    """The fit to spectra with each further part that pays, the one that leaves least first."""
    while more := with_one(found, further):
        rough = min(more, key=left)
        best = spectral(found.data, rough.values, rough.z)
        if paid(best) >= paid(found):
            break
        found = best
    return found


def nearest(effect: Effect) -> dict[str, float]:
    """The least size of an effect above its null value."""
    (strength,) = (item for item in effect.parameters if not item.shape)
    return {strength.name: min(size for size in strength.sizes if size > strength.null)}


def spectral(data: Data, values: Values, z: Array) -> Fit:
    """A fit to spectra, to its end."""
    return fitting.fit(data, values, z, STEPS, rounds=ROUNDS)


def with_one(fit: Fit, effects: Iterable[Effect]) -> list[Fit]:
    """Fits to spectra of a few steps with one effect more, under each law from the start that promises most."""
    plane = Plane(fit)

    def promised(values: Values) -> float:
        moved = fitting.at(fit.data, fit.values | values, fit.z)
        return plane.gain((moved.reduced - fit.reduced).ravel(), (0.0, 2.0))[0]

    ways = [
        (effect, place)
        for effect in effects
        if effect.name not in fit.names
        for place in range(len(effect.laws))
    ]
    best = [max(starting(*way), key=promised) for way in ways]
    return [fitting.fit(fit.data, fit.values | values, fit.z, ROUGH, rounds=1) for values in best]


def starting(effect: Effect, place: int) -> Iterator[Values]:
    """The effect under a law with parameters from which a fit may start: at its sizes, or so densely as a resonance."""
    (strength,) = (item for item in effect.parameters if not item.shape)
    sizes: Iterable[float] = strength.sizes
    if math.isinf(strength.null):
        least, most = 0.5 * min(sizes), 2.0 * max(sizes)
        sizes = np.geomspace(least, most, math.ceil(math.log(most / least, APART))).tolist()
    for size in sizes:
        yield {effect.name: effect.under(place, effect.values({strength.name: size}))}


def left(fit: Fit) -> float:
    """What a fit to spectra leaves: the geometric mean over readings, so that each counts by its own share."""
    return float(np.exp(np.mean(np.log(np.mean(np.square(fit.reduced), axis=0)))))


def paid(fit: Fit) -> float:
    """What a fit to spectra leaves, and a tenth more for each parameter, which must take away as much."""
    return left(fit) / BETTER ** frees(fit)


def shed(fit: Fit) -> Fit:
    """The fit to spectra without parts that do not pay."""
    for name in fit.names:
        rest = {key: values for key, values in fit.values.items() if key != name}
        less = spectral(fit.data, rest, fit.z)
        if paid(less) <= paid(fit) and (worth.strained(fit) or not worth.strained(less)):
            fit = less
    return fit


def zeros(bare: Fit, signals: Sequence[str]) -> Values:
    """Readings that are off by a constant, which spectra do not show: each by the mean of what a fit leaves."""
    data = bare.data
    off = dict(
        zip(data.part.signals, np.mean(data.residual(lay(data, bare.z, {})), axis=0).tolist(), strict=True)
    )
    return {
        effect.name: {effect.parameters[0].name: off[effect.signal]}
        for effect in data.part.candidates
        if effect.fault == "bias" and effect.signal in signals
    }


def moving(fit: Fit) -> Values:
    """The effects of a fit that change a reading visibly."""
    sizes = zip(fit.names, worth.changes(fit), strict=True)
    return {name: fit.values[name] for name, size in sizes if not worth.idle(fit, [size])}
