"""The specimen is stiffer or softer than the static test said.

    f = factor·k·δ

Not to be confused with a wrong load cell (`sensor.column_force.gain`): for a linear specimen the two
cannot be told apart by these signals.
"""

from __future__ import annotations

from models.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, factor: float) -> System:
    """Elastic stiffness multiplied by `factor`."""
    return system.scaled("column", "stiffness", factor)


EFFECT = Effect(
    name="column.stiffness",
    site="column",
    kind="physics",
    says="the specimen is stiffer or softer",
    parameters=(
        Parameter("factor", "", null=1.0, least=0.1, most=5.0, sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3)),
    ),
    reference="f = factor·k·δ",
    apply=apply,
)
