"""KR-α method: explicit, unconditionally stable, with controllable numerical damping (Kolay and Ricles 2014).

    v_{k+1} = v_k + Δt·α1·a_k,   x_{k+1} = x_k + Δt·v_k + Δt²·α2·a_k
    M·((I − α3)·a_{k+1} + α3·a_k) + C·v_{k+1−αf} + f_{k+1−αf} = p_{k+1−αf}

with everything at k + 1 − αf the average (1 − αf)·(·)_{k+1} + αf·(·)_k. Second order for a linear
structure; ρ∞ = 1 has no numerical damping and is the method of Chen and Ricles (2008). K is the initial
stiffness of the whole structure, specimen included.
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

PREVIOUS_BALANCE, RESIDUAL = MEMORY, MEMORY + 1  # g_{k−1}, and a scratch row


def weights(rho_infinity: float) -> tuple[float, float]:
    """(αm, αf) of a spectral radius at infinity (Kolay and Ricles 2014, eq. 22)."""
    return (2.0 * rho_infinity - 1.0) / (rho_infinity + 1.0), rho_infinity / (rho_infinity + 1.0)


def coefficients(M: Array, C: Array, K: Array, interval: float, rho_infinity: float) -> Array:
    """Matrices of the step: inverse of M(I − α3), Mα3, C, Δt·α1, Δt²·α2, and the averages; shape (6, n, n)."""
    alpha_m, alpha_f = weights(rho_infinity)
    gamma = 0.5 - alpha_m + alpha_f
    beta = 0.25 * (0.5 + gamma) ** 2
    dt, identity = interval, np.eye(M.shape[0])
    alpha = M + gamma * dt * C + beta * dt**2 * K
    alpha_1 = np.linalg.solve(alpha, M)
    alpha_2 = (0.5 + gamma) * alpha_1
    alpha_3 = np.linalg.solve(alpha, alpha_m * M + alpha_f * gamma * dt * C + alpha_f * beta * dt**2 * K)
    inverse = np.linalg.inv(M @ (identity - alpha_3))
    average = np.zeros_like(M)
    average[0, 0] = alpha_f
    return np.stack([inverse, M @ alpha_3, C, dt * alpha_1, dt**2 * alpha_2, average])


def start(M: Array, C: Array, x0: Array, v0: Array, g0: Array, interval: float) -> Array:  # noqa: ARG001
    """State from which the first step gives x0 and v0 at its tick; `g0` is the force balance there, N."""
    state = rest(x0.size)
    state[NEXT_DISPLACEMENT], state[NEXT_VELOCITY] = x0, v0
    state[VELOCITY], state[ACCELERATION] = v0, np.linalg.solve(M, g0 - C @ v0)
    state[PREVIOUS_BALANCE] = g0
    return state


@jit
def step(c: Array, s: Array, g: Array, interval: float) -> None:
    """Move on by one tick; `g` is the external minus the restoring force at NEXT_DISPLACEMENT, N."""
    n = g.size
    past = c[5, 0, 0]
    for i in range(n):
        residual = (1.0 - past) * g[i] + past * s[PREVIOUS_BALANCE, i]
        for j in range(n):
            velocity = (1.0 - past) * s[NEXT_VELOCITY, j] + past * s[VELOCITY, j]
            residual -= c[1, i, j] * s[ACCELERATION, j] + c[2, i, j] * velocity
        s[RESIDUAL, i] = residual
    for i in range(n):
        s[PREVIOUS_BALANCE, i] = g[i]
        s[DISPLACEMENT, i] = s[NEXT_DISPLACEMENT, i]
        s[VELOCITY, i] = s[NEXT_VELOCITY, i]
        acceleration = 0.0
        for j in range(n):
            acceleration += c[0, i, j] * s[RESIDUAL, j]
        s[ACCELERATION, i] = acceleration
    for i in range(n):
        velocity, displacement = s[VELOCITY, i], s[DISPLACEMENT, i] + interval * s[VELOCITY, i]
        for j in range(n):
            velocity += c[3, i, j] * s[ACCELERATION, j]
            displacement += c[4, i, j] * s[ACCELERATION, j]
        s[NEXT_VELOCITY, i] = velocity
        s[NEXT_DISPLACEMENT, i] = displacement
