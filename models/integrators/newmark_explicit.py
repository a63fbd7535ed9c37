"""Explicit Newmark method, β = 0, γ = 1/2 (Newmark 1959).

    (M + Δt/2·C)·a_k = g_k − C·(v_{k−1} + Δt/2·a_{k−1})
    v_k = v_{k−1} + Δt/2·(a_{k−1} + a_k),   x_{k+1} = x_k + Δt·v_k + Δt²/2·a_k

Second order, no numerical damping, stable for ω·Δt < 2. The next velocity is estimated as v_k + Δt·a_k.
"""

from __future__ import annotations

import numpy as np

from models.compiled import jit
from models.integrators.state import (
    ACCELERATION,
    DISPLACEMENT,
    MEMORY,
    NEXT_DISPLACEMENT,
    NEXT_VELOCITY,
    VELOCITY,
    rest,
)
from models.registry import Array

HALFWAY, RESIDUAL = MEMORY, MEMORY + 1  # v + Δt/2·a, and a scratch row


def coefficients(M: Array, C: Array, _K: Array, interval: float, _rho_infinity: float) -> Array:
    """Inverse of (M + Δt/2·C), and C; shape (2, n, n)."""
    return np.stack([np.linalg.inv(M + 0.5 * interval * C), C])


def start(M: Array, C: Array, x0: Array, v0: Array, g0: Array, interval: float) -> Array:
    """State from which the first step gives x0 and v0 at its tick; `g0` is the force balance there, N."""
    state = rest(x0.size)
    state[NEXT_DISPLACEMENT], state[NEXT_VELOCITY] = x0, v0
    state[HALFWAY] = v0 - 0.5 * interval * np.linalg.solve(M, g0 - C @ v0)
    return state


@jit
def step(c: Array, s: Array, g: Array, interval: float) -> None:
    """Move on by one tick; `g` is the external minus the restoring force at NEXT_DISPLACEMENT, N."""
    n = g.size
    for i in range(n):
        residual = g[i]
        for j in range(n):
            residual -= c[1, i, j] * s[HALFWAY, j]
        s[RESIDUAL, i] = residual
    for i in range(n):
        acceleration = 0.0
        for j in range(n):
            acceleration += c[0, i, j] * s[RESIDUAL, j]
        displacement = s[NEXT_DISPLACEMENT, i]
        velocity = s[HALFWAY, i] + 0.5 * interval * acceleration
        halfway = velocity + 0.5 * interval * acceleration
        s[DISPLACEMENT, i] = displacement
        s[VELOCITY, i] = velocity
        s[ACCELERATION, i] = acceleration
        s[HALFWAY, i] = halfway
        s[NEXT_DISPLACEMENT, i] = displacement + interval * halfway
        s[NEXT_VELOCITY, i] = halfway + 0.5 * interval * acceleration
