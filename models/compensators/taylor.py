"""Prediction of the target by its Taylor series.

`u = r + τ·ṙ + τ²/2·r̈ + τ³/6·r⃛` (m) up to the chosen order: eqs. (5) and (6) of Yokoyama et al. (17WCEE,
2020) for the first two. Exact on an actuator that is a pure delay τ and a target of that degree. Not to be
confused with `horiuchi`, which needs no derivatives but past targets, nor with `inverse`, whose
coefficients tell a lag from a dead time.
"""

from __future__ import annotations

from typing import NamedTuple

from common.plan.schema import Rule
from models.compensators.wanted import Wanted
from models.compiled import jit
from models.registry import Array


class TaylorParams(NamedTuple):
    """How far the target is predicted, and by how many terms."""

    lead: float  # τ, s
    order: float  # 1, 2 or 3


RULES = {
    "lead": Rule("time the target is predicted ahead", "s", least=0.0, most=1.0),
    "order": Rule("highest derivative used, a whole number", least=1.0, most=3.0),
}


@jit
def predict(lead: float, order: float, wanted: Wanted) -> float:
    """Target (m) predicted `lead` seconds ahead."""
    predicted = wanted.target + lead * wanted.rate
    if order >= 2.0:
        predicted += 0.5 * lead * lead * wanted.acceleration
    if order >= 3.0:
        predicted += lead * lead * lead / 6.0 * wanted.jerk
    return predicted


@jit
def step(p: Array, wanted: Wanted) -> float:
    """Target (m) predicted `lead` seconds ahead."""
    return predict(p[0], p[1], wanted)
