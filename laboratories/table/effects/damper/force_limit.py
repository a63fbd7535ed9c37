"""Saturation of the drive: the motor has a largest force.

    T_m·u̇ + u = clip(damper_command, −force, +force)

With `law` 1 the motor saturates gradually, as iron does: u/(1 + |u/force|ⁿ)^(1/n) with n = sharpness in the place of
the clip.

Not to be confused with `damper.gain`, which is there at small commands too, or `damper.stroke_stop`.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import bend_sharpness, sets, which_law

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
            bends_by="sharpness",
        ),
    },
    further={
        "": which_law(1.0, "0 suddenly, 1 gradually"),
        "force_limit_sharpness": bend_sharpness(
            "how suddenly the motor's force bends at the limit under law 1"
        ),
    },
    laws=(Law("sudden", {}), Law("gradual", {"sharpness": 3.0})),
    says="the motor has a largest force",
    reference="T_m·u̇ + u = clip(damper_command, ±force)",
)
