"""How strong a ground motion is: spectral acceleration of a linear oscillator."""

from __future__ import annotations

import math

import numpy as np

from models.compiled import jit_apart
from models.registry import Array


def spectral_acceleration(ground: Array, interval: float, period: float, damping_ratio: float) -> float:
    """Pseudo-spectral acceleration ω²·max|x| (m/s²) of an oscillator under a ground acceleration (n,) in m/s².

    `ẍ + 2ζω·ẋ + ω²·x = −z̈` from rest, exact for an acceleration that is linear between its samples, at intervals and
    with a period in s. Source: N. C. Nigam, P. C. Jennings, Calculation of response spectra from strong-motion
    earthquake records, Bull. Seism. Soc. Am. 59 (1969).
    """
    omega = 2.0 * math.pi / period
    return omega**2 * float(farthest(propagation(omega, damping_ratio, interval), ground))


def propagation(omega: float, damping_ratio: float, interval: float) -> Array:
    """Propagation of displacement and velocity over an interval; (2, 4), the last two columns for z̈ at its ends.

    By one matrix exponential with the acceleration and its slope as further states (Van Loan 1978).
    """
    from scipy.linalg import expm

    rates = np.zeros((4, 4))
    rates[0, 1] = 1.0
    rates[1, :3] = -(omega**2), -2.0 * damping_ratio * omega, -1.0
    rates[2, 3] = 1.0 / interval
    whole = expm(interval * rates)[:2]
    return np.ascontiguousarray(np.column_stack([whole[:, :2], whole[:, 2] - whole[:, 3], whole[:, 3]]))


@jit_apart
def farthest(matrix: Array, ground: Array) -> float:
    """The largest displacement of an oscillator that starts from rest with the first sample."""
    x, v, most = 0.0, 0.0, 0.0
    for at in range(1, ground.size):
        before, after = ground[at - 1], ground[at]
        x, v = (
            matrix[0, 0] * x + matrix[0, 1] * v + matrix[0, 2] * before + matrix[0, 3] * after,
            matrix[1, 0] * x + matrix[1, 1] * v + matrix[1, 2] * before + matrix[1, 3] * after,
        )
        most = max(most, abs(x))
    return most
