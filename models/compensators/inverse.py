"""Inverse of a first-order lag with dead time, as a series in the target's derivatives.

The actuator `K·e^(−Ls)/(1 + Ts)` has the inverse `(1 + Ts)·e^(Ls)/K`, whose series gives

    u = (r + (L + T)·ṙ + (L²/2 + L·T)·r̈ + (L³/6 + L²·T/2)·r⃛)/K      (m)

up to the chosen order. The idea of a fixed inverse of the identified actuator is that of Chen and Ricles
(Journal of Structural Engineering 135, 2009) and of Carrion and Spencer's model-based feedforward (NSEL
report 6, 2007). Not to be confused with `taylor`, which takes the whole `L + T` for a dead time and so
overdoes the second term by T²/2, nor with `ats`, which finds the coefficients during the test.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.plan.schema import Rule
from models.compensators.wanted import Wanted
from models.compiled import jit
from models.registry import Array


class InverseParams(NamedTuple):
    """The actuator that is inverted, and the terms kept of its inverse."""

    delay: float  # L, s
    time_constant: float  # T, s
    gain: float = 1.0  # K, –
    order: float = 2.0  # 1, 2 or 3


RULES = {
    "delay": Rule("dead time of the actuator", "s", least=0.0, most=1.0),
    "time_constant": Rule("time constant of the actuator", "s", least=0.0, most=1.0),
    "gain": Rule("static gain of the actuator", above=0.0),
    "order": Rule("highest derivative used, a whole number", least=1.0, most=3.0),
}


def coefficients(delay: float, time_constant: float, gain: float, order: float) -> Array:
    """Factors (4,) of r, ṙ, r̈, r⃛ (1, s, s², s³ over the gain); zero beyond the order."""
    L, T = delay, time_constant
    series = np.array([1.0, L + T, L**2 / 2.0 + L * T, L**3 / 6.0 + L**2 * T / 2.0]) / gain
    series[int(order) + 1 :] = 0.0
    return series


def pack(params: Array, _interval: float) -> Array:
    """Parameters followed by the coefficients."""
    return np.concatenate([params, coefficients(*params.tolist())])


@jit
def series(p: Array, at: int, wanted: Wanted) -> float:
    """Command (m) from the coefficients that begin at `at`."""
    early = p[at] * wanted.target + p[at + 1] * wanted.rate
    return early + p[at + 2] * wanted.acceleration + p[at + 3] * wanted.jerk


@jit
def step(p: Array, wanted: Wanted) -> float:
    """Command (m)."""
    return series(p, 4, wanted)
