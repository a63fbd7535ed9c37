"""Fixed inverse of a servo-hydraulic actuator with its specimen, as a series in the target's derivatives.

    u = a₀·r + a₁·ṙ + a₂·r̈ + a₃·r⃛      (m; a₀ –, a₁ s, a₂ s², a₃ s³)

The coefficients are those of the denominator of a linear plant `1/(a₀ + a₁s + a₂s² + a₃s³)`, the feedforward of
Carrion and Spencer (NSEL report 6, 2007) and of Phillips and Spencer (Journal of Structural Engineering 139, 2013).
The defaults fit the plant of the benchmark control problem (Silva, Gomez, Maghareh, Dyke and Spencer, Mechanical
Systems and Signal Processing 135, 2020). Not to be confused with `inverse`, whose coefficients come from a lag with
dead time, nor with `amb`, which adapts these.
"""

from __future__ import annotations

from typing import NamedTuple

from common.plan.schema import Rule
from models.compensators import inverse
from models.compensators.wanted import Wanted
from models.compiled import jit
from models.registry import Array


class SeriesParams(NamedTuple):
    """Factors of the target and of its derivatives."""

    a0: float = 0.99254  # –
    a1: float = 0.024889  # s
    a2: float = 1.0662e-4  # s²
    a3: float = 3.8564e-7  # s³


RULES = {
    "a0": Rule("factor of the target", above=0.0, most=10.0),
    "a1": Rule("factor of the target's rate", "s", least=0.0, most=1.0),
    "a2": Rule("factor of the target's acceleration", "s²", least=0.0, most=1.0),
    "a3": Rule("factor of the target's jerk", "s³", least=0.0, most=1.0),
}


@jit
def step(p: Array, wanted: Wanted) -> float:
    """Command (m)."""
    return inverse.series(p, 0, wanted)
