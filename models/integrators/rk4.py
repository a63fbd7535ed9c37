"""Classical Runge-Kutta method of order 4 on the numerical part, the load held over the step.

    (x, v)_{k+1} = (x, v)_k + h·φ(h·A)·(v_k, a_k),    M·a_k + C·v_k = g_k
    φ(h·A) = I + h·A/2 + (h·A)²/6 + (h·A)³/24,    A = [[0, I], [−M⁻¹·K, −M⁻¹·C]]

W. Kutta, Beitrag zur näherungsweisen Integration totaler Differentialgleichungen, Z. Math. Phys. 46 (1901), 435-453.
The four stages see a linear structure whose load does not change within the step, so that they come to one matrix.
M, C and K are those of the numerical part: its restoring force follows the stages, while what is measured and what
loads the structure is known at t_k alone. The free motion of the numerical part is of order 4; what is held over the
step acts half a step late, so that the whole is of order 1.

Stable for a numerical part below a limit on ω·h: √8 without damping, and for damping ratios up to 1 at least 2.61,
where they are near 0.5. Beyond a ratio of 1 the faster of a mode's two decays counts: its rate times h stays below
2.785. It damps a mode of frequency ω by (ω·h)⁵/144 of critical damping.

Not to be confused with a method that knows the load at the middle of the step.
"""

from __future__ import annotations

import numpy as np

from models.compiled import jit
from models.integrators.state import (
    ACCELERATION,
    DISPLACEMENT,
    NEXT_DISPLACEMENT,
    NEXT_VELOCITY,
    VELOCITY,
    begin,
    stack,
)
from models.registry import Array

# blocks of h·φ: displacement from v and from a, velocity from v and from a; then M⁻¹ and M⁻¹·C
FROM_VELOCITY, FROM_ACCELERATION, GAIN_VELOCITY, GAIN_ACCELERATION, INVERSE_MASS, RATE = range(6)


def coefficients(M: Array, C: Array, K: Array, interval: float) -> Array:
    """Coefficients (6, n, n) of `step` from the numerical part's matrices (n, n) in kg, N·s/m and N/m."""
    n, inverse = M.shape[0], np.linalg.inv(M)
    step = exponent(M, C, K, interval)
    square = step @ step
    phi = interval * (np.eye(2 * n) + step / 2.0 + square / 6.0 + square @ step / 24.0)
    return stack(phi[:n, :n], phi[:n, n:], phi[n:, :n], phi[n:, n:], inverse, inverse @ C)


def exponent(M: Array, C: Array, K: Array, interval: float) -> Array:
    """`h·A` (2n, 2n) of the numerical part's matrices (n, n) in kg, N·s/m and N/m, and the interval h in s."""
    n, inverse = M.shape[0], np.linalg.inv(M)
    return interval * np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ C]])


def excess(M: Array, C: Array, K: Array, interval: float) -> float:
    """By how much an eigenvalue of the step's propagation matrix is beyond 1 in magnitude; below 0 where none is.

    The step moves (x, v) of the unloaded numerical part by `P = I + h·A·φ(h·A)`, a polynomial of h·A, whose eigenvalues
    are `1 + z + z²/2 + z³/6 + z⁴/24` with z those of h·A. Where a motion grows by itself (Re z > 0), which a specimen
    can hold, its own growth exp(Re z) stands in place of 1.
    """
    z = np.linalg.eigvals(exponent(M, C, K, interval))
    moved = np.abs(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0))))
    return float(np.max(moved - np.exp(np.maximum(z.real, 0.0))))


def initial_state(c: Array, M: Array, C: Array, x0: Array, v0: Array, g0: Array, interval: float) -> Array:
    """State (ROWS, n) before the first step, for displacement x0 m, velocity v0 m/s and force g0 N at t_0."""
    return begin(x0, v0, np.linalg.solve(M, g0 - C @ v0))


@jit
def step(c: Array, s: Array, g: Array, interval: float) -> None:
    """One tick: force `g` (n,) N at x_k, without damping, moves the state `s` on by the interval (s)."""
    n = g.size
    for i in range(n):
        s[DISPLACEMENT, i] = s[NEXT_DISPLACEMENT, i]
        s[VELOCITY, i] = s[NEXT_VELOCITY, i]
    for i in range(n):
        a = 0.0
        for j in range(n):
            a += c[INVERSE_MASS, i, j] * g[j] - c[RATE, i, j] * s[VELOCITY, j]
        s[ACCELERATION, i] = a
    for i in range(n):
        x, v = s[DISPLACEMENT, i], s[VELOCITY, i]
        for j in range(n):
            x += c[FROM_VELOCITY, i, j] * s[VELOCITY, j] + c[FROM_ACCELERATION, i, j] * s[ACCELERATION, j]
            v += c[GAIN_VELOCITY, i, j] * s[VELOCITY, j] + c[GAIN_ACCELERATION, i, j] * s[ACCELERATION, j]
        s[NEXT_DISPLACEMENT, i] = x
        s[NEXT_VELOCITY, i] = v
