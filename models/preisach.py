"""A force, or a displacement, over state and history: Preisach's operator in its play form, beside terms of the rate.

    y = Σᵢ ψᵢ(pᵢ, m) + φ(v/V, x/X),    pᵢ ← min(max(pᵢ, x/X − rᵢ), x/X + rᵢ),    m = max |x|/X so far

Each ψᵢ is a broken line of the play pᵢ, with a part that changes as m passes thresholds (a system that ages); r₀ = 0
is a function of x alone. Outside the last knot every line goes on straight. y is linear in the weights, so they are
found by linear regression; the memory is the plays and m, so the law can be marched in any simulation. Bilinear,
Masing's and flag-shaped hysteresis, clearance and friction are special cases, with radii on a grid.

P. Krejčí, Hysteresis, Convexity and Dissipation in Hyperbolic Equations (1996), section II.3: every Preisach operator
is such a sum of functions of plays. A. Visintin, Differential Models of Hysteresis (1994), chapter IV.

A law is one array: how many radii, knots and thresholds there are, X, V, then radii, knots, thresholds and weights.
Without weights it is the grid alone, of which `features` gives what the weights multiply.
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
    """Where a law's broken lines bend, all as shares of the reach."""

    radii: tuple[float, ...]
    knots: tuple[float, ...]  # on each side of zero
    ages: tuple[float, ...]  # largest deformations so far from which on it ages


def pack(grid: Grid, reach: float, speed: float) -> Array:
    """A law without weights, of a motion that reaches `reach` m and `speed` m/s."""
    head = (float(len(grid.radii)), float(len(grid.knots)), float(len(grid.ages)), reach, speed)
    return np.array([*head, *grid.radii, *grid.knots, *grid.ages])


def memory(law: Array) -> Array:
    """Memory of a law at rest: plays and largest deformation; then the features of the last step."""
    if law.size == 0:
        return np.zeros(0)
    return np.zeros(int(law[RADII]) + 1 + count(law))


def count(law: Array) -> int:
    """How many weights a law has."""
    return int(law[RADII] * (2 + 2 * law[KNOTS] + law[AGES])) + RATES


def features(grid: Array, x: Array, v: Array) -> Array:
    """What the weights multiply, (n, q), for a motion x (n,) m from rest with its rate v (n,) m/s."""
    result = np.empty((x.size, count(grid)))
    fill(grid, memory(grid), x, v, result)
    return result


def play(law: Array, x: Array, v: Array) -> Array:
    """What a law gives (n,) for a motion x (n,) m from rest with its rate v (n,) m/s."""
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
    """What the law gives at a place x (m) with rate v (m/s), reached on a straight way; the memory moves on."""
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
    """Move the memory on to a place, and write the features there behind it."""
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
