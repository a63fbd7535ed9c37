"""A measured motion without the noise of its sensor, where that would make forces that the specimen did not have.

A dashpot or a mass that is driven by a reading multiplies the reading's noise by frequency: 3 µm at 1024 Hz are 300 N
of 150 kN·s/m. A hysteretic law that is driven by the rows of a static test turns back at every row that noise moved
back, and forgets force.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy import fft, optimize

from models.registry import Array

BAND = 64  # lines of a spectrum whose mean square is compared with the noise
# Times the noise's mean square, beyond which a band holds motion: that of so many lines of noise varies by 0.18.
MOVING = 1.75
MEDIAN = 0.4549  # of the square of a standard normal number
UPPER = 0.5  # share of all frequencies of which the noise is told, and which motion must leave free
# Standard deviations of noise, by which two rows of 10 000 differ at most: a smaller turn may be noise.
TURN = 8.0
SWING = 0.05  # of the range of a motion, by which it goes back at least after a turn that counts
FADE = 1.25  # times the highest frequency of the motion, up to which a reading fades away


class Smoothing(NamedTuple):
    """What is kept of a reading of a motion, by the lines of its cosine transform."""

    kept: Array  # (n,) share of each line
    noise: float  # rms of its white noise


def smoothing(reading: Array) -> Smoothing | None:
    """What to keep of a reading (n,): no frequency above the highest at which it exceeds its white noise.

    None where the upper half of its frequencies is not free of motion, or has no noise.
    """
    lines = fft.dct(reading, norm="ortho")
    bands = np.square(lines[: lines.size // BAND * BAND]).reshape(-1, BAND).mean(axis=1)
    noise = float(np.median(np.square(lines[round(UPPER * lines.size) :]))) / MEDIAN
    moving = np.flatnonzero(bands > MOVING * noise)
    highest = (moving[-1] + 1) * BAND if moving.size else 0
    if noise == 0.0 or bands.size < 2 or FADE * highest > UPPER * lines.size:
        return None
    places = np.arange(lines.size)
    fading = np.clip((places - highest) / ((FADE - 1.0) * max(highest, 1)), 0.0, 1.0)
    return Smoothing(0.5 * (1.0 + np.cos(np.pi * fading)), math.sqrt(noise))


def smoothed(reading: Array) -> Array:
    """A reading (n,) of a motion with no frequencies left above the highest at which it exceeds its white noise.

    The reading as it is where these cannot be told. What is left out is at most as large as the noise there.
    """
    found = smoothing(reading)
    return reading if found is None else kept(found, reading)


def noise_left(reading: Array, seed: int) -> Array:
    """A draw (n,) of the white noise that smoothing leaves in a reading, at the frequencies of its motion."""
    found = smoothing(reading)
    if found is None:
        return np.zeros(reading.size)
    return kept(found, found.noise * np.random.default_rng(seed).standard_normal(reading.size))


def kept(what: Smoothing, values: Array) -> Array:
    """What is kept of values (n,)."""
    return np.asarray(fft.idct(what.kept * fft.dct(values, norm="ortho"), norm="ortho"))


def without_small_turns(path: Array, error: float) -> Array:
    """A path (n,) that rises or falls all the way between turns that are larger than its rms error makes them.

    Between two turns it is the monotone path that is nearest to the rows (isotonic regression, R. E. Barlow et al.,
    Statistical inference under order restrictions (1972)). A path without smaller turns stays as it is.
    """
    borders = turns(path, TURN * error)
    result = path.copy()
    for begin, end in pairwise(borders):
        rises = bool(path[end] >= path[begin])
        result[begin : end + 1] = optimize.isotonic_regression(path[begin : end + 1], increasing=rises).x
    return result


def missed_at_turns(path: Array) -> float:
    """Rms (m) of how much farther a motion went at its turns than its rows (n,) show, of which none is at a turn.

    Where the motion bends by b from row to row and turns τ rows from the next one, it goes farther by b·τ²/2.
    """
    places = [place for place in turns(path, SWING * float(np.ptp(path))) if 0 < place < len(path) - 1]
    if not places:
        return 0.0
    bends = np.diff(path, 2)[np.array(places) - 1]
    return 0.5 * math.sqrt(float(np.mean(np.square(bends))) / 80.0)  # 1/80: mean of τ⁴


def turns(path: Array, least: float) -> list[int]:
    """Places of a path's (n,) first and last rows, and of the turns after which it goes back by more than `least`."""
    places, far, back = [0], 0, 0
    way = 0  # 1 where it rises, −1 where it falls, 0 where neither is known
    for place, value in enumerate(path.tolist()):
        if way == 0:
            far, back = (place if value > path[far] else far), (place if value < path[back] else back)
            if path[far] - path[back] > least:
                way, far = (1 if far > back else -1), place
        elif way * (value - path[far]) > 0.0:
            far = place
        elif way * (path[far] - value) > least:
            places.append(far)
            way, far = -way, place
    return [*places, len(path) - 1] if places[-1] < len(path) - 1 else places
