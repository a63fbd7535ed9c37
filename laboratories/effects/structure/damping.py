"""The numerical structure is damped more or less than planned.

    C_true = factor · C, of every storey

Not to be confused with a delay in the transfer system, which takes damping from the loop as c = −k·τ but is visible
between command and achieved displacement.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on
from models.system import System


def apply(system: System, factor: float) -> System:
    """Storey dashpots, or the damping ratio in their place, multiplied by `factor`."""
    name = "damping_ratio" if system.plan.structure.damping_ratio > 0.0 else "damping"
    return system.scaled("structure", name, factor)


EFFECT = factor_on(
    "structure",
    "damping",
    apply,
    says="the numerical dashpots are stronger or weaker",
    reference="M·ẍ + C·ẋ + f(x) = −M·z̈ with factor·C",
    bounds=(0.0, 20.0),
    sizes=(0.5, 0.75, 0.9, 1.1, 1.3, 1.7),
)
