"""The damper's spring is stiffer or softer than believed.

    m·(s̈ + ÿ) = −factor·k·s − c·ṡ + u

Nothing changes where the plan has k = 0. Not to be confused with `damper.mass`: both move the damper's
period, but only the mass changes how far the motor and the table throw it.
"""

from __future__ import annotations

from models.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, factor: float) -> System:
    """Spring multiplied by `factor`."""
    return system.scaled("damper", "stiffness", factor)


EFFECT = Effect(
    name="damper.stiffness",
    site="damper",
    kind="physics",
    says="the damper's spring is stiffer or softer",
    parameters=(
        Parameter("factor", "", null=1.0, least=0.0, most=20.0, sizes=(0.5, 0.75, 0.9, 1.1, 1.4, 2.0)),
    ),
    reference="k_true = factor·k",
    apply=apply,
)
