"""Damping identified from a free vibration, and damping lost by an imperfect transfer system."""

from __future__ import annotations

import cmath
import math

import numpy as np

from common.errors import InputError
from models.indicators.checks import checked, moving
from models.registry import Array

LEAST = 20  # samples of a free vibration: four for each of the five parameters that are fitted
# Bounds of damped frequency and decay, both over the frequency of the spectrum's peak: an octave on either side of it,
# and damping ratios up to 0.7.
BOUNDS = ([0.5, -1.0], [2.0, 1.0])
STARTS = (
    0.002,
    0.02,
    0.1,
)  # damping ratios from which the fit starts, those of light, usual and heavy damping
PADDING = 8  # factor on the length of the spectrum by zeros: its peak is then found to an eighth of a line
TURN = (
    0.05  # rad: phase of the delay per continuation step, small enough that Newton's method stays on its root
)


def free_vibration_damping(displacement: Array, interval: float) -> tuple[float, float]:
    """Undamped natural frequency (Hz) and damping ratio of a free vibration (n,) sampled every `interval` s.

    Least squares of one decaying or growing sine about a level; a negative ratio says that it grows.

    Raises:
        InputError: too short, not finite or constant.
    """
    from scipy import optimize

    checked(displacement=displacement)
    moving(displacement=displacement)
    if displacement.size < LEAST:
        raise InputError(f"{displacement.size} samples are too few for a free vibration: give {LEAST}.")
    t = np.arange(displacement.size, dtype=np.float64) * interval
    scale = float(np.max(np.abs(displacement)))
    y = displacement / scale
    spectrum = np.abs(np.fft.rfft(y - y.mean(), PADDING * y.size))
    omega = 2.0 * math.pi * float(np.fft.rfftfreq(PADDING * y.size, interval)[int(np.argmax(spectrum))])

    def misfit(x: Array) -> Array:
        base = decaying(t, x[0] * omega, x[1] * omega)
        weights = np.linalg.lstsq(base, y, rcond=None)[0]
        return np.asarray(base @ weights - y)

    fits = [
        optimize.least_squares(misfit, [1.0, sign * start], bounds=BOUNDS)
        for start in STARTS
        for sign in (1.0, -1.0)
    ]
    damped, decay = (np.array(min(fits, key=lambda fit: fit.cost).x) * omega).tolist()
    natural = math.hypot(damped, decay)
    return natural / (2.0 * math.pi), decay / natural


def decaying(t: Array, damped: float, decay: float) -> Array:
    """Cosine and sine of a decay (1/s) at a damped frequency (rad/s), and a level; (n, 3), of size one at most."""
    exponent = -decay * t
    envelope = np.exp(exponent - exponent.max())
    return np.column_stack([envelope * np.cos(damped * t), envelope * np.sin(damped * t), np.ones(t.size)])


def damping_equivalent(stiffness: float, amplitude: float, delay: float, omega: float) -> tuple[float, float]:
    """Dashpot (N·s/m) and stiffness (N/m) that a transfer system of amplitude A and delay d (s) takes from the loop.

    `c_lost = k·A·sin(ωd)/ω`, `k_lost = k·(1 − A·cos ωd)` at ω (rad/s), for a stiffness k (N/m) behind it:
    the first harmonic of `k·A·x(t − d)`. Source: Horiuchi, Inoue, Konno and Namita, Real-time hybrid
    experimental system with actuator delay compensation, Earthq. Eng. Struct. Dyn. 28 (1999).
    """
    phase = omega * delay
    return stiffness * amplitude * math.sin(phase) / omega, stiffness * (1.0 - amplitude * math.cos(phase))


def damping_points(dashpot: float, mass: float, stiffness: float) -> float:
    """Damping ratio of a dashpot (N·s/m) with a mass (kg) and a stiffness (N/m): `c/(2·√(K·M))`."""
    return dashpot / (2.0 * math.sqrt(stiffness * mass))


def apparent_damping(
    mass: float, damping: float, stiffness: float, experimental: float, amplitude: float, delay: float
) -> float:
    """Damping ratio of one degree of freedom whose experimental stiffness acts with amplitude A after a delay.

    It is that of the dominant root of `M·s² + C·s + K − k + k·A·e^(−s·d) = 0`, found by continuation from zero delay
    with Newton's method. M in kg, C in N·s/m, K the whole and k the experimental stiffness in N/m, d in s.

    Raises:
        InputError: no root is found near the undelayed one.
    """
    s = cmath.sqrt(damping**2 - 4.0 * mass * stiffness + 0j) / (2.0 * mass) - damping / (2.0 * mass)
    steps = max(1, math.ceil(abs(s) * delay / TURN))
    for number in range(1, steps + 1):
        share = number / steps
        late, size = share * delay, 1.0 + share * (amplitude - 1.0)
        s = newton(s, mass, damping, stiffness, experimental, size, late)
    return -s.real / abs(s)


def newton(
    s: complex, mass: float, damping: float, total: float, k: float, size: float, late: float
) -> complex:
    """The characteristic equation's root next to `s`; raises InputError where there is none."""
    for _ in range(50):  # it converges quadratically, so that few are needed
        delayed = k * size * cmath.exp(-s * late)
        value = mass * s * s + damping * s + total - k + delayed
        change = value / (2.0 * mass * s + damping - late * delayed)
        s -= change
        if abs(change) <= 1e-12 * abs(s):
            return s
    raise InputError("The loop has no vibration near that of the undelayed structure.")
