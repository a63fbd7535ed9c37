"""Central difference method.

    (M/Δt² + C/(2Δt))·x_{k+1} = g_k + (2M/Δt²)·x_k − (M/Δt² − C/(2Δt))·x_{k−1}

(Chopra, Dynamics of Structures, section 5.3). Second order, no numerical damping, stable for ω·Δt < 2.
Velocity and acceleration of the tick are the central differences; the next velocity is estimated as
v_k + Δt·a_k.
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

PREVIOUS, LOAD = MEMORY, MEMORY + 1  # x_{k−1}, and a scratch row


def coefficients(M: Array, C: Array, _K: Array, interval: float, _rho_infinity: float) -> Array:
    """Inverse of the left-hand matrix, and the two on the right; shape (3, n, n)."""
    inertia, damping = M / interval**2, C / (2.0 * interval)
    return np.stack([np.linalg.inv(inertia + damping), 2.0 * inertia, inertia - damping])


def start(M: Array, C: Array, x0: Array, v0: Array, g0: Array, interval: float) -> Array:
    """State from which the first step gives x0 and v0 at its tick; `g0` is the force balance there, N."""
    state = rest(x0.size)
    state[NEXT_DISPLACEMENT], state[NEXT_VELOCITY] = x0, v0
    state[PREVIOUS] = x0 - interval * v0 + 0.5 * interval**2 * np.linalg.solve(M, g0 - C @ v0)
    return state


@jit
def step(c: Array, s: Array, g: Array, interval: float) -> None:
    """Move on by one tick; `g` is the external minus the restoring force at NEXT_DISPLACEMENT, N."""
    n = g.size
    for i in range(n):
        load = g[i]
        for j in range(n):
            load += c[1, i, j] * s[NEXT_DISPLACEMENT, j] - c[2, i, j] * s[PREVIOUS, j]
        s[LOAD, i] = load
    for i in range(n):
        following = 0.0
        for j in range(n):
            following += c[0, i, j] * s[LOAD, j]
        previous, displacement = s[PREVIOUS, i], s[NEXT_DISPLACEMENT, i]
        velocity = (following - previous) / (2.0 * interval)
        acceleration = ((following - displacement) - (displacement - previous)) / (interval * interval)
        s[DISPLACEMENT, i] = displacement
        s[VELOCITY, i] = velocity
        s[ACCELERATION, i] = acceleration
        s[PREVIOUS, i] = displacement
        s[LOAD, i] = following
        s[NEXT_VELOCITY, i] = velocity + interval * acceleration
    for i in range(n):
        s[NEXT_DISPLACEMENT, i] = s[LOAD, i]
