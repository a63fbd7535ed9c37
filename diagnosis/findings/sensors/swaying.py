"""An error that is a share of the motion, of its slope or of its bend, where that share changes in time.

A gain that sways, a contact that loosens and comes back, or oil that warms do that. The mean share of a test may be
none, and noise of a colour may hide the rest. But at each frequency at which the share may change, all of a test speaks
at once: times the motion such an error is a wave, of which a periodogram shows one line.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from diagnosis.findings.sites.signatures import alone
from diagnosis.findings.verdict import OwnError, PartVerdict
from diagnosis.fits import hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.unexplained import BOTH, MATERIAL
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.signals.noise.rounding import SHOWS
from models.registry import Array

# Nats of a line beyond what noise has, from which on it counts, and from which on another reading may show it as well.
# Of noise the highest line of a laboratory's readings has 9 on average; in 40 recordings of clean laboratories none had
# more than 13.5.
SURE, MAYBE = 20.0, 13.0
FASTEST = 0.2  # of the rate of averaged samples, up to which a share changes
FINER = 4  # lines per line of a record's length, so that none falls between two


class Sway(NamedTuple):
    """How a reading errs by a share of the motion that changes in time."""

    nats: float  # by which the strongest line stands out of noise
    ratio: float  # rms of that error over σ
    frequency: float  # Hz


def sways(fit: Fit) -> list[Sway]:
    """How every reading errs by a share of its motion that changes in time."""
    data = fit.data
    predicted = np.nan_to_num(data.part.predict(hypothesis.lay(data, fit.z, fit.values)))
    begun = predicted - predicted[0]
    slope = np.gradient(begun, axis=0)
    motions = [data.whitened(x / data.sigma) for x in (begun, slope, np.gradient(slope, axis=0))]
    interval = data.system.plan.test.interval * data.group
    result = []
    for place, live in enumerate(data.live):
        moved = np.stack([x[:, place] for x in motions], axis=1)
        left = without_steady(fit.reduced[:, place], moved)
        found = [line(left, one, interval) for one in moved.T] if live else []
        best = max(found, key=lambda one: one.nats, default=Sway(0.0, 0.0, 0.0))
        result.append(best._replace(ratio=best.ratio / math.sqrt(data.group)))
    return result


def without_steady(left: Array, motions: Array) -> Array:
    """What is left (n,) without shares of motions (n, 3) that do not change in time.

    Of a motion that is strong for a short time such a share, as of a channel that is 50 µs late, shows in many lines.
    """
    size = np.sqrt(np.sum(motions**2, axis=0))
    moved = motions / np.where(size > 0.0, size, 1.0)
    return np.asarray(left - moved @ np.linalg.lstsq(moved, left)[0])


def line(left: Array, motion: Array, interval: float) -> Sway:
    """The strongest line of the product of what is left (n,) and a motion (n,), beyond the record's first line.

    Of white noise of variance v a line |Σ left·motion·exp(-iωt)|²/(v·Σ motion²) is an exponential number of mean one.
    What does not change in time, or over the whole of the record once, nominal parameters may have left. Residuals have
    unit variance, less where they are measured by what a model may err by as well, which must not be credited.
    """
    energy, variance = float(np.sum(motion**2)), max(1.0, float(np.mean(left**2)))
    if not energy > 0.0:
        return Sway(0.0, 0.0, 0.0)
    lines = FINER * left.size
    nats = np.abs(np.fft.rfft(left * motion, lines)[FINER : int(FASTEST * lines)]) ** 2 / (variance * energy)
    best = int(np.argmax(nats))
    rms = math.sqrt(2.0 * float(nats[best]) * variance / left.size)
    return Sway(float(nats[best]), rms, (best + FINER) / (lines * interval))


def own_error(verdict: PartVerdict, part: LaboratoryPart) -> OwnError | None:
    """The share of the motion that changes in time of the reading that shows it most."""
    data = verdict.search.data
    found = sways(verdict.search.chosen)
    least = np.maximum(MATERIAL, BOTH * data.fine.good / data.sigma)
    smooth = data.rounded <= SHOWS * data.white
    seen = [
        place
        for place, one in enumerate(found)
        if smooth[place] and one.nats > SURE and one.ratio > least[place]
    ]
    if not seen:
        return None
    place = max(seen, key=lambda place: found[place].nats)
    name, most = data.part.signals[place], found[place]
    text = (
        f"{name} errs by a share of its motion that changes in time, most at {most.frequency:.2g} Hz: a gain that "
        "sways, a contact that loosens or something that warms may cause that."
    )
    lone = sum(one.nats > MAYBE for one in found) == 1
    sites = alone(part, data.system, name) if lone else ()
    return OwnError(name, most.ratio, sites, text)
