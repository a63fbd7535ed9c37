"""CR method: explicit and unconditionally stable without numerical damping (Chen and Ricles 2008).

    v_{k+1} = v_k + Δt·α·a_k,   x_{k+1} = x_k + Δt·v_k + Δt²·α·a_k,   M·a_k + C·v_k = g_k
    α = 4·(4M + 2Δt·C + Δt²·K)⁻¹·M

Second order; K is the initial stiffness of the whole structure, specimen included.
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

RESIDUAL = MEMORY  # a scratch row


def coefficients(M: Array, C: Array, K: Array, interval: float, _rho_infinity: float) -> Array:
    """Inverse of M, C and Δt·α; shape (3, n, n)."""
    alpha = 4.0 * np.linalg.solve(4.0 * M + 2.0 * interval * C + interval**2 * K, M)
    return np.stack([np.linalg.inv(M), C, interval * alpha])


def start(M: Array, C: Array, x0: Array, v0: Array, g0: Array, interval: float) -> Array:  # noqa: ARG001
    """State from which the first step gives x0 and v0 at its tick."""
    state = rest(x0.size)
    state[NEXT_DISPLACEMENT], state[NEXT_VELOCITY] = x0, v0
    return state


@jit
def step(c: Array, s: Array, g: Array, interval: float) -> None:
    """Move on by one tick; `g` is the external minus the restoring force at NEXT_DISPLACEMENT, N."""
    n = g.size
    for i in range(n):
        residual = g[i]
        for j in range(n):
            residual -= c[1, i, j] * s[NEXT_VELOCITY, j]
        s[RESIDUAL, i] = residual
    for i in range(n):
        s[DISPLACEMENT, i] = s[NEXT_DISPLACEMENT, i]
        s[VELOCITY, i] = s[NEXT_VELOCITY, i]
        acceleration = 0.0
        for j in range(n):
            acceleration += c[0, i, j] * s[RESIDUAL, j]
        s[ACCELERATION, i] = acceleration
    for i in range(n):
        change = 0.0
        for j in range(n):
            change += c[2, i, j] * s[ACCELERATION, j]
        s[NEXT_DISPLACEMENT, i] = s[DISPLACEMENT, i] + interval * (s[VELOCITY, i] + change)
        s[NEXT_VELOCITY, i] = s[VELOCITY, i] + change
