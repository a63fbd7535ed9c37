"""Bouc-Wen hysteresis (Bouc 1967; Wen 1976).

    f = α·k·δ + (1 − α)·k·δ_y·z,   δ_y·dz/dδ = 1 − |z|ⁿ·(γ + β·sign(dδ·z))

with β + γ = 1, so that |z| stays below 1. The equation is integrated over the increment of deformation
by the classical Runge-Kutta method, in substeps of at most a tenth of the yield displacement.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from models.compiled import jit
from models.registry import Array

SHAPE, BEFORE = 0, 1  # places of z and of the last deformation in the memory
FRACTION = 0.1
MOST_SUBSTEPS = 1000


class Params(NamedTuple):
    """Its elastic branch, yield point and shape of the transition."""

    stiffness: float  # k, N/m
    yield_displacement: float  # δ_y, m
    hardening: float  # α, stiffness after yielding over before, –
    sharpness: float  # n, –
    beta: float = 0.5  # β, –; γ = 1 − β


@jit
def slope(z: float, direction: float, sharpness: float, beta: float) -> float:
    """`dz` per unit of `|dδ|/δ_y`."""
    sign = 1.0 if direction * z > 0.0 else -1.0
    return direction * (1.0 - abs(z) ** sharpness * ((1.0 - beta) + beta * sign))


@jit
def step(p: Array, s: Array, i: int, deformation: float) -> float:
    """Force (N) at a deformation (m) of the column described in row `i`, whose memory moves on."""
    change = (deformation - s[i, BEFORE]) / p[i, 1]
    direction = 1.0 if change >= 0.0 else -1.0
    substeps = min(int(math.ceil(abs(change) / FRACTION)), MOST_SUBSTEPS)
    z, n, beta = s[i, SHAPE], p[i, 3], p[i, 4]
    for _ in range(substeps):
        h = abs(change) / substeps
        k1 = slope(z, direction, n, beta)
        k2 = slope(z + 0.5 * h * k1, direction, n, beta)
        k3 = slope(z + 0.5 * h * k2, direction, n, beta)
        k4 = slope(z + h * k3, direction, n, beta)
        z = min(max(z + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), -1.0), 1.0)
    s[i, SHAPE] = z
    s[i, BEFORE] = deformation
    return p[i, 2] * p[i, 0] * deformation + (1.0 - p[i, 2]) * p[i, 0] * p[i, 1] * z
