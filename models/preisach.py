"""A force or a displacement as a function of motion and history: a Preisach operator of plays, plus rate terms.

    y = Σᵢ ψᵢ(pᵢ, m) + φ(v/V, x/X),    pᵢ ← min(max(pᵢ, x/X − rᵢ), x/X + rᵢ),    m = max |x|/X so far

Each ψᵢ is a piecewise linear function of the play pᵢ, with a part that changes as m passes thresholds (ageing); with
r₀ = 0 it is a function of x alone. Beyond the last knot every function continues straight. y is linear in the weights,
so they are found by linear regression; the memory consists of the plays and m, so any simulation can step the law.
Bilinear, Masing's and flag-shaped hysteresis, clearance and friction are special cases, with radii on a grid.

P. Krejčí, Hysteresis, Convexity and Dissipation in Hyperbolic Equations (1996), section II.3: every Preisach operator
is such a sum of functions of plays. A. Visintin, Differential Models of Hysteresis (1994), chapter IV.

A law is one array: the numbers of radii, knots and thresholds, X, V, then radii, knots, thresholds and weights. Without
weights it is a grid alone, for which `features` returns the functions that the weights multiply.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from models.compiled import jit, jit_apart
from models.registry import Array

RADII, KNOTS, AGES, REACH, SPEED, GRID = range(6)  # places in a law; X in m and V in m/s
RATES = 6  # terms of the rate: w, w|w|, |w|, tanh(10·w), |x|·w, x²·w with w = v/V
NONE = np.zeros(0)  # no law


class Grid(NamedTuple):
    """Radii and knots of a law's piecewise linear functions, and its thresholds, all over the reach X."""

    radii: tuple[float, ...]
    knots: tuple[float, ...]  # on each side of zero
    ages: tuple[float, ...]  # thresholds of the largest deformation so far


def pack(grid: Grid, reach: float, speed: float) -> Array:
    """A law without weights for motions up to `reach` (m) and `speed` (m/s)."""
    head = (float(len(grid.radii)), float(len(grid.knots)), float(len(grid.ages)), reach, speed)
    return np.array([*head, *grid.radii, *grid.knots, *grid.ages])


def memory(law: Array) -> Array:
    """Memory of a law at rest: plays, largest deformation, then the features of the last step."""
    if law.size == 0:
        return np.zeros(0)
    return np.zeros(int(law[RADII]) + 1 + count(law))


def count(law: Array) -> int:
    """The number of weights of a law."""
    return int(law[RADII] * (2 + 2 * law[KNOTS] + law[AGES])) + RATES


def features(grid: Array, x: Array, v: Array) -> Array:
    """The features (n, q), which the weights multiply, for a motion x (n,) m from rest with its rate v (n,) m/s."""
    result = np.empty((x.size, count(grid)))
    fill(grid, memory(grid), x, v, result)
    return result


def play(law: Array, x: Array, v: Array) -> Array:
    """The values of a law (n,) for a motion x (n,) m from rest with its rate v (n,) m/s."""
    size = law.size - count(law)
    result: Array = features(law, x, v) @ law[size:]
    return result


@jit_apart
def fill(grid: Array, state: Array, x: Array, v: Array, result: Array) -> None:
    """Fill the features of a motion, row by row."""
    first = int(grid[RADII]) + 1
    for k in range(x.size):
        move(grid, state, x[k], v[k])
        for i in range(result.shape[1]):
            result[k, i] = state[first + i]


@jit_apart
def step(law: Array, state: Array, x: float, v: float) -> float:
    """The value of a law at x (m) with rate v (m/s), reached monotonically from the last x; updates the memory."""
    first = int(law[RADII]) + 1
    number = state.size - first
    weights = law.size - number
    move(law, state, x, v)
    result = 0.0
    for i in range(number):
        result += law[weights + i] * state[first + i]
    return result


@jit
def move(law: Array, state: Array, x: float, v: float) -> None:
    """Update the memory to x (m) with rate v (m/s), and write the features behind it."""
    radii, knots, ages = int(law[RADII]), int(law[KNOTS]), int(law[AGES])
    here = x / law[REACH]
    state[radii] = max(state[radii], abs(here))
    place = radii + 1
    for i in range(radii):
        radius = law[GRID + i]
        p = min(max(state[i], here - radius), here + radius)
        state[i] = p
        state[place] = p
        state[place + 1] = abs(p)
        place += 2
        for j in range(knots):
            knot = law[GRID + radii + j]
            state[place] = max(p - knot, 0.0)
            state[place + 1] = min(p + knot, 0.0)
            place += 2
        for j in range(ages):
            state[place] = p * max(state[radii] - law[GRID + radii + knots + j], 0.0)
            place += 1
    w = v / law[SPEED]
    state[place] = w
    state[place + 1] = w * abs(w)
    state[place + 2] = abs(w)
    state[place + 3] = np.tanh(10.0 * w)
    state[place + 4] = abs(here) * w
    state[place + 5] = here * here * w
