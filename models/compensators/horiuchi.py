"""Prediction of the target by a polynomial through past targets one delay apart.

    u = Σ_i w_i·r(t − i·τ),   w_i = (−1)^i·C(n + 1, i + 1),   i = 0 … n      (m)

is the polynomial of order n through n + 1 points, continued by τ: 2, −1; 3, −3, 1; 4, −6, 4, −1. Horiuchi,
Inoue, Konno and Namita, Earthquake Engineering and Structural Dynamics 28 (1999) 1121–1141. Points between
ticks are taken from the cubic through the four nearest targets stored, so a cubic target stays exact
whatever the delay. Before the first tick the target counts as still. Not to be confused with `taylor`,
which has the derivatives at one instant, nor with Horiuchi and Konno's later method (2001), which
supposes a linear acceleration.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from common.plan.schema import Rule
from models.compensators.wanted import Wanted
from models.compiled import jit
from models.registry import Array


class HoriuchiParams(NamedTuple):
    """How far the target is predicted, and by a polynomial of which order."""

    delay: float  # τ, s
    order: float  # n: 1, 2 or 3


RULES = {
    "delay": Rule("time the target is predicted ahead, and between its points", "s", least=0.0, most=1.0),
    "order": Rule("order of the polynomial, a whole number", least=1.0, most=3.0),
}
TAPS, FIRST = 2, 3  # in the packed parameters: how many taps; from FIRST on pairs of (age in ticks, weight)
STARTED, HEAD, HISTORY = 0, 1, 2  # in the state; from HISTORY on a ring of targets (m)


def cubic(place: float) -> list[tuple[int, float]]:
    """Ages in ticks and weights that interpolate a history at an age `place`, which may lie between ticks."""
    if abs(place - round(place)) < 1e-9:  # a whole number of ticks, but for the rounding of the division
        return [(round(place), 1.0)]
    first = max(math.floor(place) - 1, 0)
    nodes = range(first, first + 4)
    return [(j, math.prod((place - m) / (j - m) for m in nodes if m != j)) for j in nodes]


def pack(params: Array, interval: float) -> Array:
    """Parameters, the number of taps, and each tap's age (ticks) and weight."""
    delay, order = float(params[0]), int(params[1])
    taps: dict[int, float] = {}
    for i in range(order + 1):
        weight = (-1.0) ** i * math.comb(order + 1, i + 1)
        for age, share in cubic(i * delay / interval):
            taps[age] = taps.get(age, 0.0) + weight * share
    pairs = [number for age in sorted(taps) for number in (float(age), taps[age])]
    return np.concatenate([params, [float(len(taps))], pairs])


def state(params: Array, _interval: float) -> Array:
    """Ring of the targets that the taps reach back to, empty."""
    oldest = int(params[-2])
    return np.zeros(HISTORY + oldest + 1)


@jit
def step(p: Array, s: Array, wanted: Wanted) -> float:
    """Command (m); the target joins the history."""
    size = s.size - HISTORY
    if s[STARTED] == 0.0:
        s[STARTED] = 1.0
        for i in range(size):
            s[HISTORY + i] = wanted.present
    head = int(s[HEAD])
    s[HISTORY + head] = wanted.target
    command = 0.0
    for i in range(int(p[TAPS])):
        at = head - int(p[FIRST + 2 * i])
        if at < 0:
            at += size
        command += p[FIRST + 2 * i + 1] * s[HISTORY + at]
    s[HEAD] = (head + 1) % size
    return command
