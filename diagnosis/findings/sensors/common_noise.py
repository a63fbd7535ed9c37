"""The noise of a laboratory's readings where a gap may hide behind its colour: what all of them have in common."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.fits import residuals
from diagnosis.fits.fitting import Fit
from diagnosis.fits.noise import sensor_noise
from diagnosis.fits.residuals import Data
from diagnosis.fits.unexplained import SIGNIFICANT

# Noise at its loudest frequency over that at the highest ones, up to which it counts as white beside coloured noise.
FLAT = 2.0
NOTHING = 2.0  # standard deviations, below which inputs foresee nothing of a reading


def in_common(fit: Fit) -> Data:
    """The data of a fit with noise of the colour that all readings have, each at its level of the highest frequencies.

    A logger treats its channels alike, so that what one of them has beyond that colour need not be noise. It is white
    unless most readings have coloured noise; a white one among these hides the colour behind the steps of a converter.
    A reading has noise of its own colour where the inputs foresee nothing of it, and surely what another one is missed
    by. What two readings then do not share is no colour that both have.
    """
    white, models, apart = sensor_noise.whitened(fit), sensor_noise.remodelled(fit).noise, unforeseen(fit)
    if not sensor_noise.coloured(fit.data):  # a level known from elsewhere stays
        white = residuals.measured_by(white, np.minimum(white.white, fit.data.white))
    rows = list(zip(models, white.white, apart, strict=True))
    pairs = [(item, level) for item, level, alone in rows if level > 0.0 and not alone]
    shapes = [(item, level) for item, level in pairs if sensor_noise.loudness(item, level) > FLAT]
    if 2 * len(shapes) <= sum(level > 0.0 for _, level, _ in rows):
        if not any(apart):
            return white
        noise = tuple(
            item if alone else replace(item, rms=float(level), density=None) for item, level, alone in rows
        )
    else:
        shape = np.min(
            [item.density / level**2 for item, level in shapes if item.density is not None], axis=0
        )
        rms = min(item.rms / level for item, level in shapes)
        noise = tuple(
            replace(item, rms=float(rms * level), density=level**2 * shape)
            if not alone and sensor_noise.loudness(item, level) > FLAT
            else item
            for item, level, alone in rows
        )
    return residuals.measured_by(replace(white, noise=noise), np.array([item.rms for item in noise]))


def unforeseen(fit: Fit) -> list[bool]:
    """Readings of which the inputs foresee nothing, where they surely foresee what another one is missed by."""
    sure = [one.significance for one in sensor_noise.foreseen(fit)]
    return [max(sure, default=0.0) > SIGNIFICANT and one < NOTHING for one in sure]
