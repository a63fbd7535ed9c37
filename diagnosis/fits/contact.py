"""End stops: after each impact a wrong stop sends the prediction elsewhere, so fits grow with the test.

The first residual tells when the stop was first met, and the largest stroke until then where it stands; from
there the fit is lengthened bit by bit, each piece starting from the parameters of the shorter one.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from diagnosis.fits import fitting
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Values
from diagnosis.fits.residuals import Data
from diagnosis.fits.screening import WORKERS
from laboratories.effects.effect import Effect

FIRST = 0.02  # of the largest residual, from which on the stop has been met
INSIDE = (0.97, 0.7)  # of the largest stroke before that, where a stiff and a soft stop may stand
AFTER = 0.4  # s after first contact that the shortest fit covers
LONGER = 1.3  # factor from one fit to the next
BEYOND = (
    30.0  # times the stroke before that: no motion that meets a stop goes so far, not even an unstable one
)
EVERY = 5  # of so many averaged samples one judges


def stopped(data: Data, fit: Fit, effect: Effect) -> Fit | None:
    """The fit with an end stop as well, None where the motion that meets it was not recorded, is none or goes on."""
    stop = effect.contact
    if stop is None or stop.motion not in data.part.signals:
        return None
    place = data.part.signals.index(stop.motion)
    if not data.part.present[:, place].any():
        return None
    bare = fitting.at(data, fit.values, np.zeros(fit.z.size))
    missed = np.max(np.abs(bare.reduced), axis=1)
    first = int(np.argmax(missed > FIRST * missed.max()))
    stroke = np.abs(data.part.measured[:, place])
    reached = float(np.max(stroke[: max(1, first * data.group)]))
    if reached <= 0.0 or float(np.nanmax(stroke)) > BEYOND * reached:
        return None
    begun = (
        {stop.place: share * reached, stop.stiffness: stiffness}
        for share in INSIDE
        for stiffness in stop.starts
    )
    with ThreadPoolExecutor(WORKERS) as pool:
        fits = list(
            pool.map(lambda values: grown(data, fit, first, {**fit.values, effect.name: values}), begun)
        )
    return min(fits, key=lambda item: item.cost)


def grown(data: Data, fit: Fit, first: int, values: Values) -> Fit:
    """One start, lengthened to the whole test."""
    z = np.zeros(fit.z.size)
    groups = first + max(10, round(AFTER / (data.system.plan.test.interval * data.group)))
    while groups < data.groups:
        piece = replace(
            data, part=data.part.first(groups * data.group), train=np.arange(groups) % EVERY < EVERY - 1
        )
        shorter = fitting.fit(piece, values, z, steps=6, rounds=1)
        values, z = shorter.values, shorter.z
        groups = int(LONGER * groups) + 1
    return fitting.fit(data, values, z, steps=6, rounds=2)
