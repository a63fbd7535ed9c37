"""Noise of a reading that follows the motion: louder where its part moves more, although no motion predicts it.

A loose connector, a clock that jitters, or a gain that sways errs by a random share of what is read or of its slope.
The mean of such an error is zero, so that no effect explains it; its variance follows the motion (Breusch and Pagan,
Econometrica 47, 1979). Each time scale is asked by itself, by differences of neighbouring means, whose variance is
steady for noise of any colour (Percival and Walden, Wavelet Methods for Time Series Analysis, 2000).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from diagnosis.findings.certainty.other_causes import EITHER
from diagnosis.findings.sites.signatures import alone
from diagnosis.findings.verdict import OwnError, PartVerdict
from diagnosis.fits import hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.noise import inputs
from diagnosis.fits.noise.remainder import remainder, spans
from diagnosis.fits.noise.unsteady_noise import by_reading, evened
from diagnosis.fits.residuals import Data
from diagnosis.fits.unexplained import BOTH
from diagnosis.fits.worth import SEEN
from diagnosis.recorded.building.logged_building import BALANCE
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.signals.noise.rounding import SHOWS
from diagnosis.signals.systematic import correlations
from models.registry import Array

SCALES = (1, 2, 4, 8, 16, 32)  # ticks of the means that are held against each other
FEWEST = 50  # differences without which a scale tells nothing
# Deviations beyond which a difference counts as this far out, so that tails, and a few spikes, decide nothing.
OUTERMOST = 3.0
# Standard deviations from which on noise follows the motion: with all inputs and scales looked at, 4.6 was the most
# that 250 readings of clean laboratories behind loggers had.
SURE = 6.0
SYMMETRIC = 1e-3  # skewness below which it changes nothing
ALIKE = 1.2  # times the noise of one scale, below which that of the next one is as loud
MEANS = ("delay", "lag", "gain")  # of readings: what an error by chance that follows the motion is on average


class Uneven(NamedTuple):
    """How much of a reading's noise follows the motion."""

    ratio: float  # rms of what follows over that of the noise where the part moves least
    significance: float  # standard deviations above noise that is steady
    scale: int  # ticks over which it shows most
    usual: float = 0.0  # rms of the noise at that scale


STEADY = Uneven(0.0, 0.0, 0)


def uneven(fit: Fit) -> list[Uneven]:
    """How much of the noise of every reading follows the motion, beside what a model may err by."""
    system = hypothesis.lay(fit.data, fit.z, fit.values)
    data, rest = evened(fit.data, remainder(fit.data, system), system)
    single = rest.single
    moving = inputs.inputs(data.part, system)[: len(single)]
    motions = [amplitudes(moving, size, bends=not data.by_logger) for size in SCALES]
    said = np.nan_to_num(data.part.predict(system))[: len(single)]
    erring = BOTH * data.erring
    return [
        over_scales(single[:, place], motions, erring * said[:, place])
        if live and rounded <= SHOWS * white
        else STEADY
        for place, (live, rounded, white) in enumerate(zip(data.live, data.rounded, data.white, strict=True))
    ]


def over_scales(noise: Array, motions: Sequence[Array], erring: Array) -> Uneven:
    """How much of a noise (ticks,) follows motions beyond an error `erring` (ticks,).

    These are the `amplitudes` of each of the scales. Two of them together say more where the noise is as loud in both;
    slow noise, which is louder in longer means, is largely the same in them.
    """
    pairs = zip(SCALES, motions, strict=True)
    found = [one for size, rows in pairs if (one := at_scale(noise, rows, erring, size)) is not None]
    together = [
        Uneven(max(a.ratio, b.ratio), (a.significance + b.significance) / math.sqrt(2.0), a.scale)
        for a, b in itertools.pairwise(found)
        if b.usual < ALIKE * a.usual
    ]
    return max([*found, *together], key=lambda one: one.significance, default=STEADY)


def at_scale(noise: Array, rows: Array, erring: Array, size: int) -> Uneven | None:
    """The same by differences of neighbouring means over so many ticks; None where these are too few."""
    apart = differences(noise, size)
    usual = 1.4826 * float(np.median(np.abs(apart))) if apart.size >= FEWEST else 0.0
    if usual <= 0.0 or not rows.size:
        return None
    energy = np.minimum(np.square(apart / usual), OUTERMOST**2)
    significance, row = follows(energy, rows)
    low, high = np.quantile(row, (1.0 / 3.0, 2.0 / 3.0))
    still, loud = float(energy[row <= low].mean()), float(energy[row >= high].mean())
    beside = float(np.mean(np.square(differences(erring, size)))) / usual**2
    more = (loud - still - beside) / still if still > 0.0 else 0.0
    return Uneven(math.sqrt(max(more, 0.0)), significance, size, usual)


def differences(values: Array, size: int) -> Array:
    """Differences of neighbouring means of values (ticks, …) over `size` ticks, white noise keeping its rms."""
    count = len(values) // (2 * size)
    means = values[: 2 * size * count].reshape(count, 2, size, *values.shape[1:]).mean(axis=2)
    return np.asarray((means[:, 1] - means[:, 0]) * math.sqrt(0.5 * size))


def amplitudes(moving: Array, size: int, *, bends: bool = True) -> Array:
    """Rms (differences, columns) of each input, of its slope and, where asked for, of its bend, of those that change.

    What a reading does between the ticks, as a command's steps make a machine do, looks like noise that follows bends.
    """
    columns = np.square(inputs.motions(moving))[:, : (3 if bends else 2) * moving.shape[1]]
    count = len(columns) // (2 * size)
    rms = np.sqrt(columns[: 2 * size * count].reshape(count, 2 * size, -1).mean(axis=1))
    return np.asarray(rms[:, np.ptp(rms, axis=0) > 0.0])


def follows(energy: Array, motions: Array) -> tuple[float, Array]:
    """Largest correlation of an energy (n,) with motions (n, columns), in standard deviations, and the motion (n,).

    These are those of two series that are independent and remember: M. S. Bartlett, Journal of the Royal Statistical
    Society 98 (1935). They make no correlation more significant, so that what falls short without them is not asked.
    Where few samples hold most of a motion, chance has the skewed tail of their energy.
    """
    count, reach = energy.size, energy.size // 4
    one, others = standard(energy), standard(motions)
    along = np.mean(one[:, None] * others, axis=0)
    best, place = -math.inf, 0
    for column in np.argsort(-along):
        if along[column] * math.sqrt(count) <= best:
            break
        other = others[:, column]
        shared = correlations(one - along[column] * other, reach) @ correlations(other, reach)
        plain = float(along[column]) * math.sqrt(count / max(1.0, 1.0 + 2.0 * float(shared)))
        skew = float(np.mean(one**3) * np.mean(other**3)) / math.sqrt(count)
        found = unskewed(plain, skew)
        best, place = max((best, place), (found, int(column)))
    return best, motions[:, place]


def unskewed(deviations: float, skew: float) -> float:
    """Deviations of the normal distribution that are as rare as those of a gamma distribution with a skewness.

    E. B. Wilson and M. M. Hilferty, Proceedings of the National Academy of Sciences 17 (1931), 684-688.
    """
    if skew < SYMMETRIC or deviations <= 0.0:
        return deviations
    shape = 4.0 / skew**2
    root = (1.0 + deviations / math.sqrt(shape)) ** (1.0 / 3.0)
    return (root - 1.0 + 1.0 / (9.0 * shape)) * 3.0 * math.sqrt(shape)


def standard(values: Array) -> Array:
    """Values (n, …) with mean zero and rms one along the first axis; zero where they do not change."""
    apart = values - values.mean(axis=0)
    return np.asarray(apart / np.maximum(apart.std(axis=0), 1e-300))


def told(verdicts: Sequence[PartVerdict]) -> list[str]:
    """A sentence for each reading whose noise grows with it or comes in bursts, which counts as no gap."""
    return [line for verdict in verdicts for line in unsteady_in(verdict.search.chosen)]


def unsteady_in(fit: Fit) -> list[str]:
    """The same for the readings of a part."""
    data, system = fit.data, hypothesis.lay(fit.data, fit.z, fit.values)
    sentences = []
    found = by_reading(data, remainder(data, system).single, system)
    for signal, one in zip(data.part.signals, found, strict=True):
        if one is None:
            continue
        times = float(one.loudness.max() / one.loudness.min())
        if one.why == "grows":
            reading = "what is read" if signal == BALANCE else "its reading"
            text = f"grows with {reading}, to {times:.2g} times as much at the largest"
        else:
            at = loudest(one.loudness, data)
            text = f"comes in bursts of up to {times:.2g} times its usual level, the loudest at {at:.1f} s"
        name = "the balance of the building's forces" if signal == BALANCE else signal
        sentences.append(f"The noise of {name} {text}, and counts as no gap.")
    return sentences


def loudest(loudness: Array, data: Data) -> float:
    """When noise is loudest by its loudness (ticks,), s in the recording in which it is."""
    tick = int(np.argmax(loudness))
    begins = [span.start or 0 for span in spans(data.part)]
    return (tick - max(begin for begin in begins if begin <= tick)) * data.system.plan.test.interval


def following(verdict: PartVerdict) -> dict[str, Uneven]:
    """The noise of the readings, by signal, that surely follows the motion."""
    found = zip(verdict.search.data.part.signals, uneven(verdict.search.chosen), strict=True)
    return {name: one for name, one in found if one.significance > SURE and one.ratio > SEEN}


def own_error(verdict: PartVerdict, part: LaboratoryPart, aside: Collection[str] = ()) -> OwnError | None:
    """The noise that follows the motion most; something else is known of readings `aside`."""
    data = verdict.search.data
    seen = {name: one for name, one in following(verdict).items() if name not in aside}
    if not seen:
        return None
    name, most = max(seen.items(), key=lambda item: item[1].significance)
    sites = alone(part, data.system, name) if len(seen) == 1 else ()
    text = (
        f"The noise of {name} follows the motion, as that of no effect of the catalogue does: a loose connector, a "
        "clock that jitters, a gain that sways or chatter of the machine may cause that."
    )
    return OwnError(name, most.ratio, sites, text)


def doubting(verdict: PartVerdict, part: LaboratoryPart, aside: Collection[str]) -> PartVerdict:
    """The verdict that an error of one reading explains a gap: in part only, where its noise follows the motion.

    The mean of what makes the noise looks like another error: a clock that is late by chance has a delay on average, a
    contact that sways a gain. What a saturation leaves where the reading bends follows the motion as well.
    """
    catalogue = verdict.search.data.catalogue
    sites = {catalogue[name].site for name in verdict.effects}
    if len(sites) > 1 or any(catalogue[name].fault not in MEANS for name in verdict.effects):
        return verdict
    own = own_error(verdict, part, aside)
    if own is None or not own.sites or part.lab.sensor(own.signal) not in sites:
        return verdict
    others = tuple((fit, EITHER * chance) for fit, chance in verdict.others)
    return replace(
        verdict, outcome="partly", probability=EITHER * verdict.probability, others=others, own=own
    )


def beside_effects(verdict: PartVerdict, loud: Collection[str]) -> tuple[PartVerdict, set[str]]:
    """The verdict on effects, and the readings, by signal, whose `loud` noise beside them follows the motion.

    Few sensors are louder in motion than at rest. What looks like their noise is rather left by the effects, whose law
    is not the true one: they explain a gap in part.
    """
    if not verdict.effects or not set(loud) & set(verdict.search.data.part.signals):
        return verdict, set()
    left = {name: one for name, one in following(verdict).items() if name in loud}
    if left and verdict.outcome == "explained":
        name, most = max(left.items(), key=lambda item: item[1].significance)
        text = f"The noise of {name} beside the effects named follows the motion: their law leaves it."
        verdict = replace(verdict, outcome="partly", own=OwnError(name, most.ratio, (), text))
    return verdict, set(left)
