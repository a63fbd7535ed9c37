"""A reading whose zero jumps now and then, as where counts are lost, which looks like slow noise.

White noise about a level that jumps is held against steady noise that remembers, by their likelihoods.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import fft

from diagnosis.findings.sites.likely import APART
from diagnosis.findings.verdict import OwnError, PartVerdict
from diagnosis.fits import hypothesis
from diagnosis.fits.residuals import Data, filled
from diagnosis.fits.worth import SEEN
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.signals.noise import colour
from diagnosis.signals.noise.rounding import SHOWS
from models.registry import Array

MOST = 40  # jumps: a zero that jumps more often is slow noise
SHORTEST = 4  # averaged samples between two jumps
# Of slow noise beside white noise: how fast it forgets, in squared radians per averaged sample, and its variance per
# sample over that of the white noise.
FORGETTING = (0.0, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
GROWING: Array = np.geomspace(1e-6, 10.0, 60)


class Jumps(NamedTuple):
    """A level that jumps."""

    places: tuple[int, ...]  # samples before which it jumps
    level: Array  # (n,)
    white: float  # rms of the noise about it
    nats: float  # by which it is likelier than steady noise


def found_in(noise: Array) -> Jumps:
    """The level that jumps about which noise (n,) is most likely white, with what speaks for it."""
    apart = noise - noise.mean()
    count = apart.size
    places: list[int] = []
    best = Jumps((), np.zeros(count), 0.0, -math.inf)
    for place in [0, *splits(apart)]:
        places = sorted({*places, place} - {0})
        level = levels(apart, places)
        variance = float(np.mean(np.square(apart - level)))
        # each jump takes two numbers, of which Schwarz's criterion charges half the logarithm of the count
        nats = -0.5 * count * math.log(max(variance, 1e-300)) - len(places) * math.log(count)
        if nats > best.nats:
            best = Jumps(tuple(places), level, math.sqrt(variance), nats)
    return best._replace(nats=best.nats - steady(apart))


def splits(noise: Array) -> list[int]:
    """The samples at which noise (n,) is cut into two means in turn, at each the one that takes most energy away."""
    sums = np.concatenate([[0.0], np.cumsum(noise)])
    pieces = [best_split(sums, 0, noise.size)]
    result: list[int] = []
    while pieces and len(result) < MOST:
        energy, first, place, end = heapq.heappop(pieces)
        if energy >= 0.0:
            break
        result.append(place)
        for piece in (best_split(sums, first, place), best_split(sums, place, end)):
            heapq.heappush(pieces, piece)
    return result


def best_split(sums: Array, first: int, end: int) -> tuple[float, int, int, int]:
    """Minus the energy that two means take away from a piece of a sum (n + 1,), its first sample, the cut, its end."""
    places = np.arange(first + SHORTEST, end - SHORTEST + 1)
    if not places.size:
        return 0.0, first, first, end
    before, after = places - first, end - places
    apart = (sums[places] - sums[first]) / before - (sums[end] - sums[places]) / after
    energy = before * after / (end - first) * apart**2
    best = int(np.argmax(energy))
    return -float(energy[best]), first, int(places[best]), end


def levels(noise: Array, places: Sequence[int]) -> Array:
    """The mean of noise (n,) in each piece between places, (n,)."""
    pieces = np.split(noise, places)
    return np.concatenate([np.full(piece.size, piece.mean()) for piece in pieces])


def steady(noise: Array) -> float:
    """Log likelihood of noise (n,) that remembers, as of white noise it is -n/2 log variance, less what numbers cost.

    It is an autoregression, or white noise beside slow noise, which forgets or grows without end.
    """
    count = noise.size
    costs = [
        count * math.log(max(model.variance, 1e-300)) + (model.order + 1) * math.log(count)
        for model in colour.burg([noise], colour.MOST)
    ]
    energy = np.square(fft.dct(noise, norm="ortho")[1:])
    turning = 2.0 - 2.0 * np.cos(np.pi * np.arange(1, count) / count)
    for forgets in FORGETTING:
        shapes = 1.0 + GROWING[:, None] / (turning + forgets)
        variances = np.mean(energy / shapes, axis=1)
        whole = count * np.log(variances) + np.sum(np.log(shapes), axis=1)
        costs.append(float(whole.min()) + 2.0 * math.log(count))
    return -0.5 * min(costs)


def own_error(verdict: PartVerdict, part: LaboratoryPart) -> OwnError | None:
    """The jumps of the zero of one reading; what several readings show is a motion."""
    data = verdict.search.data
    found = {place: jumping(verdict, place) for place in range(len(data.part.signals)) if slow(data, place)}
    seen = {place: one for place, one in found.items() if one.places and one.nats > APART}
    if len(seen) != 1:
        return None
    ((place, one),) = seen.items()
    name = data.part.signals[place]
    ratio = float(one.level.std()) / max(math.sqrt(data.group) * one.white, 1e-300)
    if ratio < SEEN:
        return None
    times = ", ".join(f"{data.group * tick * data.system.plan.test.interval:.2f}" for tick in one.places)
    text = (
        f"The zero of {name} jumps at {times} s, which no noise does: counts or contact may have been lost."
    )
    return OwnError(name, ratio, (part.lab.sensor(name),), text)


def slow(data: Data, place: int) -> bool:
    """Whether a reading has noise of a colour that rounding does not make."""
    if not data.noise or data.noise[place].density is None:
        return False
    return bool(data.rounded[place] <= SHOWS * data.white[place])


def jumping(verdict: PartVerdict, place: int) -> Jumps:
    """The level about which a reading jumps, in averaged samples."""
    data, fit = verdict.search.data, verdict.search.chosen
    residual = data.residual(hypothesis.lay(data, fit.z, fit.values))[:, place]
    return found_in(data.averaged(filled(residual, data.there[:, place])))
