"""Prediction of the target by its Taylor series.

`u = r + τ·ṙ + τ²/2·r̈` up to the chosen order: eqs. (5) and (6) of Yokoyama et al. (17WCEE, 2020).
"""

from __future__ import annotations

from typing import NamedTuple

from models.compiled import jit
from models.registry import Array


class Params(NamedTuple):
    """How far the target is predicted, and by how many terms."""

    lead: float  # τ, s
    order: float  # 1 or 2


@jit
def step(p: Array, target: float, rate: float, acceleration: float) -> float:
    """Target (m) predicted `lead` seconds ahead."""
    predicted = target + p[0] * rate
    if p[1] >= 2.0:
        predicted += 0.5 * p[0] * p[0] * acceleration
    return predicted
