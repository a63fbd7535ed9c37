"""Explicit Newmark method, β = 0, γ = 1/2, with the damping implicit.

    x_{k+1} = x_k + h·v_k + h²/2·a_k
    v_k = v_{k−1} + h/2·(a_{k−1} + a_k)
    (M + h/2·C)·a_k = g_k − C·(v_{k−1} + h/2·a_{k−1})

N. M. Newmark, A method of computation for structural dynamics, J. Eng. Mech. Div. ASCE 85 (1959), 67-94.
Order 2; stable up to ω·h = 2 for the highest mode, whatever its damping; no numerical damping.

Not to be confused with Newmark's average acceleration (β = 1/4), which is implicit and always stable.
It gives the displacements of the central difference method from another recursion.
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

HALF_STEP_VELOCITY = MEMORY  # v_{k−1} + h/2·a_{k−1} before the step at tick k

FORCE, DAMPING = range(2)  # (M + h/2·C)⁻¹, and that times C


def coefficients(M: Array, C: Array, K: Array, interval: float) -> Array:
    """Coefficients (2, n, n) of `step` from matrices (n, n) in kg, N·s/m and N/m; K is not needed."""
    inverse = np.linalg.inv(M + 0.5 * interval * C)
    return stack(inverse, inverse @ C)


def initial_state(c: Array, M: Array, C: Array, x0: Array, v0: Array, g0: Array, interval: float) -> Array:
    """State (ROWS, n) before the first step, for displacement x0 m, velocity v0 m/s and force g0 N at t_0."""
    a0 = np.linalg.solve(M, g0 - C @ v0)
    s = begin(x0, v0, a0)
    s[HALF_STEP_VELOCITY] = v0 - 0.5 * interval * a0
    return s


@jit
def step(c: Array, s: Array, g: Array, interval: float) -> None:
    """One tick: force `g` (n,) N at x_k, without damping, moves the state `s` on by the interval (s)."""
    n = g.size
    half = 0.5 * interval
    for i in range(n):
        a = 0.0
        for j in range(n):
            a += c[FORCE, i, j] * g[j] - c[DAMPING, i, j] * s[HALF_STEP_VELOCITY, j]
        s[ACCELERATION, i] = a
    for i in range(n):
        a = s[ACCELERATION, i]
        x = s[NEXT_DISPLACEMENT, i]
        v = s[HALF_STEP_VELOCITY, i] + half * a
        ahead = v + half * a
        s[DISPLACEMENT, i] = x
        s[VELOCITY, i] = v
        s[HALF_STEP_VELOCITY, i] = ahead
        s[NEXT_DISPLACEMENT, i] = x + interval * ahead
        s[NEXT_VELOCITY, i] = ahead + half * a
