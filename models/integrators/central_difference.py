"""Central difference method, with the damping at the same instant as the forces.

    M·(x_{k+1} − 2·x_k + x_{k−1})/h² + C·(x_{k+1} − x_{k−1})/(2h) = g_k

A. K. Chopra, Dynamics of Structures (4th ed. 2012), section 5.3; in real time:
M. Nakashima, H. Kato, E. Takaoka, Earthquake Eng. Struct. Dyn. 21 (1992), 79-92. The recursion carries
the increment `d_k = x_k − x_{k−1}` in place of x_{k−1}, which avoids the difference of large numbers:

    (M + h/2·C)·d_{k+1} = h²·g_k + (M − h/2·C)·d_k

Order 2; stable up to ω·h = 2 for the highest mode, whatever its damping; no numerical damping.

Not to be confused with the variant that takes C at t_{k−1/2}, which needs no inverse where C is full but
is of first order and has a smaller stability limit.
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

INCREMENT = MEMORY  # d_k before the step at tick k
NEXT_INCREMENT = MEMORY + 1  # scratch

FORCE, REPEAT = range(2)  # h²·(M + h/2·C)⁻¹, and (M + h/2·C)⁻¹·(M − h/2·C)


def coefficients(M: Array, C: Array, K: Array, interval: float) -> Array:
    """Coefficients (2, n, n) of `step` from matrices (n, n) in kg, N·s/m and N/m; K is not needed."""
    inverse = np.linalg.inv(M + 0.5 * interval * C)
    return stack(interval**2 * inverse, inverse @ (M - 0.5 * interval * C))


def initial_state(c: Array, M: Array, C: Array, x0: Array, v0: Array, g0: Array, interval: float) -> Array:
    """State (ROWS, n) before the first step, for displacement x0 m, velocity v0 m/s and force g0 N at t_0."""
    a0 = np.linalg.solve(M, g0 - C @ v0)
    s = begin(x0, v0, a0)
    s[INCREMENT] = interval * v0 - 0.5 * interval**2 * a0
    return s


@jit
def step(c: Array, s: Array, g: Array, interval: float) -> None:
    """One tick: force `g` (n,) N at x_k, without damping, moves the state `s` on by the interval (s)."""
    n = g.size
    for i in range(n):
        d = 0.0
        for j in range(n):
            d += c[FORCE, i, j] * g[j] + c[REPEAT, i, j] * s[INCREMENT, j]
        s[NEXT_INCREMENT, i] = d
    rate = 1.0 / interval
    for i in range(n):
        d = s[NEXT_INCREMENT, i]
        v = 0.5 * rate * (s[INCREMENT, i] + d)
        a = rate * rate * (d - s[INCREMENT, i])
        x = s[NEXT_DISPLACEMENT, i]
        s[DISPLACEMENT, i] = x
        s[VELOCITY, i] = v
        s[ACCELERATION, i] = a
        s[INCREMENT, i] = d
        s[NEXT_DISPLACEMENT, i] = x + d
        s[NEXT_VELOCITY, i] = v + interval * a
