"""KR-α method: explicit in displacement and velocity, always stable, with chosen numerical damping.

    w_{k+1} = w_k + h·α₁·b_k,    x_{k+1} = x_k + h·w_k + (1/2 + γ)·h²·α₁·b_k
    M·((I − α₃)·b_k + α₃·b_{k−1}) = (1 − α_f)·r_k + α_f·r_{k−1},    r_k = g_k − C·w_k
    A = M + γ·h·C + β·h²·K,    α₁ = A⁻¹·M,    α₃ = A⁻¹·(α_m·M + α_f·γ·h·C + α_f·β·h²·K)

C. Kolay and J. M. Ricles, Development of a family of unconditionally stable explicit direct integration
algorithms with controllable numerical energy dissipation, Earthquake Eng. Struct. Dyn. 43 (2014), 1361-1380,
with the spectral radius ρ at infinite frequency as the one parameter:

    α_m = (2ρ − 1)/(ρ + 1),  α_f = ρ/(ρ + 1),  γ = 1/2 − α_m + α_f,  β = (1/2 + γ)²/4

Its poles are those of the generalised-α method of Chung and Hulbert (1993): order 2; ρ = 1 damps nothing
and gives the displacements of CR; ρ = 0 removes the highest frequencies within three steps. Stable for any ω·h as
long as no stiffness exceeds the K of the coefficients.

The published velocity w_k is that of the time t_k − γ·h: right to first order only where it is read at t_k.
So w stays in the memory here, and the rows of the state hold `v_k = w_k + γ·(w_{k+1} − w_k)`, the next
velocity carried on by γ·h in the same way, and the acceleration with which `M·a_k + C·v_k = g_k`.
The displacements are the published ones. All that the next tick needs of b_{k−1} and r_{k−1} is the vector
`q_k = (M·(I − α₃))⁻¹·(α_f·r_{k−1} − M·α₃·b_{k−1})`, kept in their place.

Not to be confused with the MKR-α method of the same authors (2019), which overshoots less at large ω·h,
nor with HHT-α, which is implicit.
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
    begin,
    stack,
)
from models.registry import Array

EARLY_VELOCITY = MEMORY  # w_k before the step at tick k
HISTORY = MEMORY + 1  # q_k before the step at tick k
FILTERED = MEMORY + 2  # b_k, scratch

FORCE, DAMPING, REPEAT, CHANGE, INVERSE_MASS, RATE, GAMMA, RHO = range(8)


def coefficients(M: Array, C: Array, K: Array, interval: float, rho_infinity: float = 0.5) -> Array:
    """Coefficients (8, n, n) of `step` from matrices (n, n) in kg, N·s/m and N/m; K is the initial stiffness.

    With `W = (1 − α_f)·(M·(I − α₃))⁻¹`: W, W·C, (I − α₃)⁻¹·α₃, h·α₁, M⁻¹, M⁻¹·C, and γ and ρ in every place.
    """
    unit = np.eye(M.shape[0])
    alpha_m = (2.0 * rho_infinity - 1.0) / (rho_infinity + 1.0)
    alpha_f = rho_infinity / (rho_infinity + 1.0)
    gamma = 0.5 - alpha_m + alpha_f
    damped = gamma * interval * C + 0.25 * (0.5 + gamma) ** 2 * interval**2 * K
    effective = np.linalg.inv(M + damped)
    alpha_3 = effective @ (alpha_m * M + alpha_f * damped)
    rest = np.linalg.inv(unit - alpha_3)
    inverse = np.linalg.inv(M)
    force = (1.0 - alpha_f) * rest @ inverse
    return stack(
        force,
        force @ C,
        rest @ alpha_3,
        interval * effective @ M,
        inverse,
        inverse @ C,
        np.full_like(unit, gamma),
        np.full_like(unit, rho_infinity),
    )


def initial_state(c: Array, M: Array, C: Array, x0: Array, v0: Array, g0: Array, interval: float) -> Array:
    """State (ROWS, n) before the first step, for displacement x0 m, velocity v0 m/s and force g0 N at t_0.

    The history is that of a steady acceleration, and w_0 the one from which the first step finds v0.
    """
    a0 = np.linalg.solve(M, g0 - C @ v0)
    gamma, rho = c[GAMMA, 0, 0], c[RHO, 0, 0]
    s = begin(x0, v0, a0)
    s[HISTORY] = (rho * a0 - c[REPEAT] @ a0) / (1.0 + rho)
    shift = gamma * c[CHANGE]
    known = v0 - shift @ (c[FORCE] @ g0 + s[HISTORY])
    s[EARLY_VELOCITY] = np.linalg.solve(np.eye(x0.size) - shift @ c[DAMPING], known)
    return s


@jit
def step(c: Array, s: Array, g: Array, interval: float) -> None:
    """One tick: force `g` (n,) N at x_k, without damping, moves the state `s` on by the interval (s)."""
    n = g.size
    gamma = c[GAMMA, 0, 0]
    rho = c[RHO, 0, 0]
    for i in range(n):
        b = s[HISTORY, i]
        for j in range(n):
            b += c[FORCE, i, j] * g[j] - c[DAMPING, i, j] * s[EARLY_VELOCITY, j]
        s[FILTERED, i] = b
    for i in range(n):
        change = 0.0
        # α_f/(1 − α_f) is ρ, so the part of r_k in q_{k+1} is ρ times that in b_k
        history = rho * (s[FILTERED, i] - s[HISTORY, i])
        for j in range(n):
            change += c[CHANGE, i, j] * s[FILTERED, j]
            history -= c[REPEAT, i, j] * s[FILTERED, j]
        w = s[EARLY_VELOCITY, i]
        x = s[NEXT_DISPLACEMENT, i]
        s[DISPLACEMENT, i] = x
        s[VELOCITY, i] = w + gamma * change
        s[HISTORY, i] = history
        s[EARLY_VELOCITY, i] = w + change
        s[NEXT_DISPLACEMENT, i] = x + interval * (w + (0.5 + gamma) * change)
        s[NEXT_VELOCITY, i] = w + (1.0 + gamma) * change
    for i in range(n):
        a = 0.0
        for j in range(n):
            a += c[INVERSE_MASS, i, j] * g[j] - c[RATE, i, j] * s[VELOCITY, j]
        s[ACCELERATION, i] = a
