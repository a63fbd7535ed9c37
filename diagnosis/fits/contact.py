"""End stops: after each impact a wrong stop sends the prediction elsewhere, so fits grow with the test.

The first residual tells when the stop was first met, and the largest stroke until then where it stands; from
there the fit is lengthened bit by bit, each piece starting from the parameters of the shorter one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.fits import fitting
from diagnosis.fits.fitting import Data, Fit, Values

EFFECT = "damper.stroke_stop"
STIFFNESSES = (500.0, 5000.0, 50000.0)  # N/m, soft to hard
FIRST = 0.02  # of the largest residual, from which on the stop has been met
INSIDE = 0.97  # of the largest stroke before that
AFTER = 0.4  # s after first contact that the shortest fit covers
LONGER = 1.3  # factor from one fit to the next
EVERY = 5  # of so many averaged samples one judges


def stopped(data: Data, fit: Fit) -> Fit | None:
    """The fit with an end stop as well, None where the damper's stroke was not recorded."""
    if "damper_stroke" not in data.part.signals or not data.part.present[:, 2].any():
        return None
    bare = fitting.at(data, fit.values, np.zeros(fit.z.size))
    missed = np.max(np.abs(bare.reduced), axis=1)
    first = int(np.argmax(missed > FIRST * missed.max()))
    reached = float(np.max(np.abs(data.part.measured[: max(1, first * data.group), 2])))
    if reached <= 0.0:
        return None
    fits = [grown(data, fit, first, INSIDE * reached, stiffness) for stiffness in STIFFNESSES]
    return min(fits, key=lambda item: item.cost)


def grown(data: Data, fit: Fit, first: int, stroke: float, stiffness: float) -> Fit:
    """One start, lengthened to the whole test."""
    values: Values = {**fit.values, EFFECT: {"stroke": stroke, "stiffness": stiffness}}
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
