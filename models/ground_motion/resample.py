"""Ground acceleration and displacement at the control interval.

The displacement is the table's target and must bring it to rest. Integrated records drift, so the integral
is corrected as usual for strong motion: a polynomial of order 6 without the orders 0 and 1 is fitted to it by
least squares and taken off, cf. D. M. Boore, J. J. Bommer, Processing of strong-motion accelerograms, Soil
Dyn. Earthquake Eng. 25 (2005), 93-115. Here the fit is also bound to the displacement and the velocity at the
record's end, so that the corrected motion ends at rest where it began. The added acceleration is smooth.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from models.ground_motion.record import GroundMotion

Array = NDArray[np.float64]


def resample(motion: GroundMotion, interval: float, duration: float) -> Array:
    """Acceleration (round(duration / interval) + 1,) in m/s² at multiples of `interval`, both in s.

    Linear between the samples. After the record's end the last value goes to zero within one interval of
    the record and stays there.
    """
    ticks = round(duration / interval) + 1
    times = motion.interval * np.arange(motion.points + 1)
    values = np.append(motion.acceleration, 0.0)
    resampled: Array = np.interp(interval * np.arange(ticks), times, values, right=0.0)
    return resampled


def ground_displacement(acceleration: Array, interval: float) -> Array:
    """Baseline-corrected displacement (n,) in m for acceleration (n,) in m/s² at intervals in s.

    Integrated exactly for a piecewise linear acceleration, from rest, and at rest again at zero from the
    first zero after the last nonzero sample on: zeros beyond change nothing, and neither does an acceleration
    polynomial of order 4 or less on top of the record. The second difference differs from the acceleration
    by under 1 % rms for the records that ship at full length.

    A record cut in the middle of its motion is brought to rest at the cut, which changes it the more the
    earlier the cut; `ground` avoids that.
    """
    nonzero = np.flatnonzero(acceleration)
    result = np.zeros(acceleration.size)
    if nonzero.size:
        moving = min(int(nonzero[-1]) + 2, acceleration.size)
        velocity, displacement = integrate(acceleration[:moving], interval)
        end = (moving - 1) * interval * float(velocity[-1])
        result[:moving] = displacement - drift(displacement, end)
    return result


def ground(motion: GroundMotion, interval: float, duration: float) -> Array:
    """Rows acceleration (m/s²) and displacement (m) at multiples of `interval` (s); (2, ticks + 1).

    The displacement is that of the whole record, so a shorter test sees the same motion up to its end.
    """
    ticks = round(duration / interval)
    whole = math.ceil((motion.duration + motion.interval) / interval) * interval
    acceleration = resample(motion, interval, max(whole, duration))
    displacement = ground_displacement(acceleration, interval)
    return np.stack(
        [acceleration[: ticks + 1], displacement[: ticks + 1]]
    )  # rows that kernels take as contiguous


def integrate(acceleration: Array, interval: float) -> tuple[Array, Array]:
    """Velocity and displacement (n,) from rest, exact for an acceleration (n,) linear between its samples."""
    before, after = acceleration[:-1], acceleration[1:]
    velocity = from_zero(0.5 * interval * (before + after))
    step = interval * velocity[:-1] + interval**2 / 6.0 * (2.0 * before + after)
    return velocity, from_zero(step)


def from_zero(increments: Array) -> Array:
    """Running sum (n + 1,) of increments (n,) that begins at zero."""
    return np.concatenate([[0.0], np.cumsum(increments)])


def drift(displacement: Array, end: float) -> Array:
    """Polynomial (n,) of orders 2 to 6 nearest to a displacement (n,), both in m, with its end's value and slope.

    In s = t / T it is the cubic with value and slope zero at the start, the displacement's last value and
    the slope `end` (velocity times T, m) at s = 1, plus s²·(1 − s)²·(c0 + c1·s + c2·s²) by least squares.
    """
    s = np.linspace(0.0, 1.0, displacement.size)
    cubic = s**2 * ((3.0 - 2.0 * s) * displacement[-1] + (s - 1.0) * end)
    bump = (s * (1.0 - s)) ** 2
    basis = np.stack([bump, bump * s, bump * s**2], axis=1)
    c = np.linalg.lstsq(basis, displacement - cubic, rcond=None)[0]
    fitted: Array = cubic + basis @ c
    return fitted
