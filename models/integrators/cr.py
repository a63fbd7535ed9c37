"""CR method: explicit in displacement and velocity, always stable.

    w_{k+1} = w_k + h·α₁·b_k,    x_{k+1} = x_k + h·w_k + h²·α₂·b_k
    M·b_k + C·w_k = g_k,    α₁ = α₂ = 4·(4M + 2h·C + h²·K)⁻¹·M

C. Chen and J. M. Ricles, Development of direct integration algorithms for structural dynamics using
discrete control theory, J. Eng. Mech. ASCE 134 (2008), 676-683. Its poles are those of
Newmark's average acceleration: order 2, no numerical damping, stable for any ω·h as long as no stiffness
exceeds the K of the coefficients.

Since α₁ = α₂, the published velocity is `w_{k+1} = (x_{k+1} − x_k)/h`, the velocity of t_{k+1/2}: right to
first order only where it is read at t_{k+1}. So w stays in the memory here, and the rows of the state hold
`v_k = (w_k + w_{k+1})/2`, the next velocity carried on by another half step, and the acceleration with
which `M·a_k + C·v_k = g_k`. The displacements are the published ones.

Not to be confused with Chang's methods, which are explicit in the displacement only.
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

MIDWAY_VELOCITY = MEMORY  # w_k before the step at tick k
CHANGE = MEMORY + 1  # w_{k+1} − w_k, scratch

FORCE, DAMPING, INVERSE_MASS, RATE = range(4)  # h·α₁·M⁻¹, that times C, M⁻¹, M⁻¹·C


def coefficients(M: Array, C: Array, K: Array, interval: float) -> Array:
    """Coefficients (4, n, n) of `step` from matrices (n, n) in kg, N·s/m, N/m; K is the initial stiffness."""
    inverse = np.linalg.inv(M)
    force = interval * np.linalg.inv(M + 0.5 * interval * C + 0.25 * interval**2 * K)
    return stack(force, force @ C, inverse, inverse @ C)


def initial_state(c: Array, M: Array, C: Array, x0: Array, v0: Array, g0: Array, interval: float) -> Array:
    """State (ROWS, n) before the first step, for displacement x0 m, velocity v0 m/s and force g0 N at t_0."""
    s = begin(x0, v0, np.linalg.solve(M, g0 - C @ v0))
    s[MIDWAY_VELOCITY] = np.linalg.solve(np.eye(x0.size) - 0.5 * c[DAMPING], v0 - 0.5 * c[FORCE] @ g0)
    return s


@jit
def step(c: Array, s: Array, g: Array, interval: float) -> None:
    """One tick: force `g` (n,) N at x_k, without damping, moves the state `s` on by the interval (s)."""
    n = g.size
    for i in range(n):
        change = 0.0
        for j in range(n):
            change += c[FORCE, i, j] * g[j] - c[DAMPING, i, j] * s[MIDWAY_VELOCITY, j]
        s[CHANGE, i] = change
    for i in range(n):
        half = 0.5 * s[CHANGE, i]
        v = s[MIDWAY_VELOCITY, i] + half
        midway = v + half
        x = s[NEXT_DISPLACEMENT, i]
        s[DISPLACEMENT, i] = x
        s[VELOCITY, i] = v
        s[MIDWAY_VELOCITY, i] = midway
        s[NEXT_DISPLACEMENT, i] = x + interval * midway
        s[NEXT_VELOCITY, i] = midway + half
    for i in range(n):
        a = 0.0
        for j in range(n):
            a += c[INVERSE_MASS, i, j] * g[j] - c[RATE, i, j] * s[VELOCITY, j]
        s[ACCELERATION, i] = a
