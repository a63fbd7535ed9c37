"""What looks like loud noise of readings, and follows from a machine's motion or from an effect."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from diagnosis.findings.sensors.slow_noise import moves
from diagnosis.findings.verdict import PartVerdict, judge
from diagnosis.fits import candidates, fitting, residuals
from diagnosis.fits.fitting import excess
from diagnosis.fits.noise import sensor_noise
from diagnosis.fits.residuals import Data
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import Search
from diagnosis.fits.threads import each
from models.registry import Array


def no_noise(verdict: PartVerdict, usual: Mapping[str, float], scales: Scales) -> PartVerdict | None:
    """The verdict on a part whose loud noise an effect or the motion of its machine makes; None where it is noise.

    `usual` is the rms noise that such readings have otherwise, by signal. Steps of a command shake a machine as noise
    does, and all its readings show it; the noise of a sensor shows in its own reading alone.
    """
    found, signals = verdict.search, verdict.search.data.part.signals
    if verdict.effects or verdict.joined or not usual.keys() & set(signals):
        return None
    white = sensor_noise.whitened(found.chosen)
    most = np.array([usual.get(name, math.inf) for name in signals])
    data = residuals.measured_by(white, np.minimum(white.white, most))
    if known := predicted(residuals.by_tick(data), found.chosen.z, scales):
        return known
    bare = fitting.fit(data, {}, found.chosen.z)
    if not moves(bare):
        return None
    return PartVerdict(
        replace(found, data=data, commissioned=bare, chosen=bare), "unknown", 1.0, verdict.others, ()
    )


def predicted(data: Data, z: Array, scales: Scales) -> PartVerdict | None:
    """The verdict with one effect that leaves nothing of what looks like noise, None where none promises as much.

    The inertia of a specimen makes a force of every step of its command, which averages of a few ticks hardly show. It
    is seen only near the true dead time, from which noise may have led a fit to z (nuisances,) away: effects are looked
    at beside the plan's parameters too.
    """
    bare, promising = max(
        (
            (fit, candidates.screened(fit, scales)[: candidates.FITTED])
            for fit in (fitting.at(data, {}, place) for place in (z, np.zeros(z.size)))
        ),
        key=lambda item: item[1][0].gain if item[1] else 0.0,
    )
    if not promising or promising[0].gain < candidates.LITTLE * excess(bare):
        return None
    fits = each(lambda item: fitting.fit(data, {item.effect.name: item.values}, item.z), promising)
    chosen, *others = sorted(fits, key=lambda item: item.cost)
    verdict = judge(Search(data, bare, chosen, tuple(others)))
    return verdict if verdict.outcome == "explained" else None
