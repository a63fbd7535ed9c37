"""Saturation of the drive: the motor has a largest force.

    T_m·u̇ + u = clip(damper_command, −force, +force)

Not to be confused with `damper.gain`, which is there at small commands too, or `damper.stroke_stop`.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "damper",
    "force_limit",
    {
        "force_limit": Parameter(
            "force",
            "N",
            null=math.inf,
            least=0.1,
            most=10000.0,
            sizes=(62.0, 50.0, 35.0, 20.0),
            says="largest magnitude",
            follows="damper_command",
        ),
    },
    says="the motor has a largest force",
    reference="T_m·u̇ + u = clip(damper_command, ±force)",
)
