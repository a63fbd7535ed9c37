"""Samples of a reading far beyond what the tails of its noise make: read from elsewhere, or disturbed.

Fits leave spikes out, as tails of a sensor's noise. But tails come in all sizes, and a few samples far above all others
are none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import ndimage, stats

from diagnosis.findings.verdict import UNNAMED, OwnError, PartVerdict
from diagnosis.fits import hypothesis
from diagnosis.fits.residuals import filled
from diagnosis.fits.worth import SEEN
from diagnosis.recorded.joined import laboratory_of
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.signals.mask import Mask
from diagnosis.signals.noise.spikes import BEYOND, LONGEST, beyond, deviation, spikes
from models.registry import Array

# Power by which tails fall beyond `BEYOND` deviations where there are few spikes: that of Student's t with three
# degrees of freedom. Of MANY spikes the median tells it, if they fall more slowly.
TAIL, MANY = 3.0, 20
# Probability that tails make such samples, below which a report tells of them, and below which they are an effect: a
# single sample of 60 deviations and of 280, three of 13 and of 22. Of normal noise and of Student's t with four degrees
# of freedom none of 300 readings of 6000 samples is told, of t with three one in a hundred.
TOLD, SURE = 1e-3, 1e-5
LISTED = 5  # times that a sentence lists


class Outliers(NamedTuple):
    """Samples of one reading that its noise does not make."""

    signal: str
    times: tuple[float, ...]  # s, of the largest sample of each
    largest: float  # in deviations of the noise
    ratio: float  # rms over the whole record, in deviations of the noise
    chance: float  # probability that the tails of noise make as many as large ones


def found_in(verdict: PartVerdict) -> list[Outliers]:
    """The outliers of a laboratory's readings, those aside that several readings show at once, as in an impact."""
    data, fit = verdict.search.data, verdict.search.chosen
    if laboratory_of(data.part) is None:
        return []
    whole = replace(data, spikes=None)
    residual = whole.residual(hypothesis.lay(data, fit.z, fit.values))
    columns = [filled(x, there) for x, there in zip(residual.T, data.part.present.T, strict=True)]
    spiky = [spikes(x) & live for x, live in zip(columns, data.live, strict=True)]
    interval = data.system.plan.test.interval
    result = []
    for place, (name, x) in enumerate(zip(data.part.signals, columns, strict=True)):
        others = np.any([mask for k, mask in enumerate(spiky) if k != place], axis=0)
        own = spiky[place] & ~ndimage.binary_dilation(others, iterations=LONGEST)
        apart = beyond(x)
        usual = np.maximum(deviation(apart), max(data.white[place], data.rounded[place]))
        sizes = np.divide(apart, usual, where=usual > 0.0, out=np.zeros(apart.size))  # no noise, no spikes
        if (found := beyond_tails(own, sizes)) is not None:
            ticks, chance = found
            energy = math.sqrt(float(np.mean(np.square(np.where(own, sizes, 0.0)))))
            times = tuple(float(tick) * interval for tick in ticks)
            result.append(Outliers(name, times, float(sizes[ticks].max()), energy, chance))
    return result


def beyond_tails(spiky: Mask, sizes: Array) -> tuple[Array, float] | None:
    """The ticks of the spikes that tails do not make, and how probably they would; None where they may make all.

    Of n spikes, tails make one larger than s with (BEYOND/s)^power: how many are larger is binomial.
    """
    labels, count = ndimage.label(spiky)
    if count == 0:
        return None
    places = np.array(
        [int(item) for item in np.ravel(ndimage.maximum_position(sizes, labels, range(1, count + 1)))]
    )
    order = places[np.argsort(-sizes[places])]
    beyond_least = np.maximum(np.log(sizes[order] / BEYOND), 1e-3)
    power = min(TAIL, math.log(2.0) / float(np.median(beyond_least))) if count >= MANY else TAIL
    shares = np.exp(-power * beyond_least)
    chances = stats.binom.sf(np.arange(count), count, shares)
    best = int(np.argmin(chances))
    if chances[best] > TOLD:
        return None
    return np.sort(order[: best + 1]), float(chances[best])


def sentence(one: Outliers) -> str:
    """What a report says of outliers."""
    times = ", ".join(f"{time:.3f}" for time in one.times[:LISTED])
    times += " …" if len(one.times) > LISTED else ""
    count = f"{len(one.times)} samples" if len(one.times) > 1 else "1 sample"
    return (
        f"{one.signal} has {count} far beyond its noise, at {times} s, by up to {one.largest:.0f} times its standard "
        "deviation. All fits leave them out: they may have been read from elsewhere, or disturbed."
    )


def own_error(verdict: PartVerdict, part: LaboratoryPart) -> OwnError | None:
    """The outliers of the reading that has the most, where they are too large and too many for chance."""
    seen = [one for one in found_in(verdict) if one.chance < SURE and one.ratio > SEEN]
    if not seen:
        return None
    most = max(seen, key=lambda one: one.ratio)
    return OwnError(most.signal, most.ratio, (part.lab.sensor(most.signal),))


def told(verdicts: Sequence[PartVerdict]) -> list[str]:
    """A sentence for each reading with outliers, of laboratories that leave nothing else unexplained."""
    whole = [verdict for verdict in verdicts if verdict.own is not None or verdict.outcome not in UNNAMED]
    return [sentence(one) for verdict in whole for one in found_in(verdict)]
