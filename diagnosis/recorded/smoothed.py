"""A measured motion without the white noise of its sensor at frequencies at which the motion has none.

A dashpot or a mass that is driven by a reading multiplies the reading's noise by frequency: 3 µm at 1024 Hz are 300 N
of 150 kN·s/m, which the force that was measured does not have.
"""

from __future__ import annotations

import numpy as np
from scipy import fft

from models.registry import Array

BAND = 64  # lines of a spectrum whose mean square is compared with the noise
# Times the noise's mean square, beyond which a band holds motion: that of so many lines of noise varies by 0.18.
MOVING = 1.75
MEDIAN = 0.4549  # of the square of a standard normal number
UPPER = 0.5  # share of all frequencies of which the noise is told, and which motion must leave free
FADE = 1.25  # times the highest frequency of the motion, up to which a reading fades away


def smoothed(reading: Array) -> Array:
    """A reading (n,) of a motion with no frequencies left above the highest at which it exceeds its white noise.

    The reading as it is where the upper half of its frequencies is not free of motion. What is left out is at most as
    large as the noise there.
    """
    lines = fft.dct(reading, norm="ortho")
    bands = np.square(lines[: lines.size // BAND * BAND]).reshape(-1, BAND).mean(axis=1)
    noise = float(np.median(np.square(lines[round(UPPER * lines.size) :]))) / MEDIAN
    moving = np.flatnonzero(bands > MOVING * noise)
    highest = (moving[-1] + 1) * BAND if moving.size else 0
    if noise == 0.0 or bands.size < 2 or FADE * highest > UPPER * lines.size:
        return reading
    places = np.arange(lines.size)
    fading = np.clip((places - highest) / ((FADE - 1.0) * max(highest, 1)), 0.0, 1.0)
    lines *= 0.5 * (1.0 + np.cos(np.pi * fading))
    return np.asarray(fft.idct(lines, norm="ortho"))
