"""The noise that all readings of a laboratory have in common, as behind one data logger."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.fits import residuals, sensor_noise
from diagnosis.fits.fitting import Fit
from diagnosis.fits.residuals import Data

# Noise at its loudest frequency over that at the highest ones, up to which it counts as white beside coloured noise.
FLAT = 2.0


def in_common(fit: Fit) -> Data:
    """The data of a fit with noise of the colour that all readings have, each at its level of the highest frequencies.

    A logger treats its channels alike, so that what one of them has beyond that colour need not be noise. It is white
    unless most readings have coloured noise; a white one among these hides the colour behind the steps of a converter.
    """
    white, models = sensor_noise.whitened(fit), sensor_noise.remodelled(fit).noise
    if not sensor_noise.coloured(fit.data):  # a level known from elsewhere stays
        white = residuals.measured_by(white, np.minimum(white.white, fit.data.white))
    pairs = [(item, level) for item, level in zip(models, white.white, strict=True) if level > 0.0]
    shapes = [(item, level) for item, level in pairs if sensor_noise.loudness(item, level) > FLAT]
    if 2 * len(shapes) <= len(pairs):
        return white
    shape = np.min([item.density / level**2 for item, level in shapes if item.density is not None], axis=0)
    rms = min(item.rms / level for item, level in shapes)
    noise = tuple(
        replace(item, rms=float(rms * level), density=level**2 * shape)
        if sensor_noise.loudness(item, level) > FLAT
        else item
        for item, level in zip(models, white.white, strict=True)
    )
    return residuals.measured_by(replace(white, noise=noise), np.array([item.rms for item in noise]))
