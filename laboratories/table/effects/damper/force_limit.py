"""Saturation of the drive: the motor has a largest force.

    T_m·u̇ + u = clip(damper_command, −force, +force)

Not to be confused with `damper.gain`, which is there at small commands too, or `damper.stroke_stop`.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, force: float) -> System:
    """Motor force of `force` N at most."""
    return system.laid("damper", force_limit=force)


EFFECT = Effect(
    name="damper.force_limit",
    site="damper",
    kind="physics",
    says="the motor has a largest force",
    parameters=(
        Parameter(
            "force",
            "N",
            null=math.inf,
            least=0.1,
            most=10000.0,
            sizes=(62.0, 50.0, 35.0, 20.0),
            says="largest magnitude",
            follows="damper_command",
        ),
    ),
    reference="T_m·u̇ + u = clip(damper_command, ±force)",
    apply=apply,
)
