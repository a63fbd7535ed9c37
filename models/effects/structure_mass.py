"""The numerical floors are heavier or lighter than believed.

    M_true = factor · M, of every storey

Not to be confused with `structure.stiffness`: both move the period, but only the mass changes how hard
the ground and the damper's force push.
"""

from __future__ import annotations

from models.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, factor: float) -> System:
    """Floor masses multiplied by `factor`."""
    return system.scaled("structure", "mass", factor)


EFFECT = Effect(
    name="structure.mass",
    site="structure",
    kind="physics",
    says="the numerical floors are heavier or lighter",
    parameters=(
        Parameter("factor", "", null=1.0, least=0.2, most=5.0, sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3)),
    ),
    reference="M·ẍ + C·ẋ + f(x) = −M·z̈ with factor·M",
    apply=apply,
)
