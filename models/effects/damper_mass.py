"""The damper's moving mass is heavier or lighter than believed.

    factor·m·(s̈ + ÿ) = −k·s − c·ṡ + u

Not to be confused with `damper.gain`: where inertia rules, both are a factor on the stroke under the motor
alone; the table's motion throws the damper as far whatever its mass.
"""

from __future__ import annotations

from models.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, factor: float) -> System:
    """Moving mass multiplied by `factor`."""
    return system.scaled("damper", "mass", factor)


EFFECT = Effect(
    name="damper.mass",
    site="damper",
    kind="physics",
    says="the damper's mass is heavier or lighter",
    parameters=(
        Parameter("factor", "", null=1.0, least=0.2, most=5.0, sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3)),
    ),
    reference="m_true = factor·m",
    apply=apply,
)
