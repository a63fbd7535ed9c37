"""Flow saturation of the servo valve: the piston has a highest speed.

    |ẏ| ≤ velocity

For servo-hydraulics the flow is limited to that of an unloaded piston at this speed: `|q| ≤ a2·velocity`. Not to be
confused with a slower servo loop, which smooths every motion; this effect leaves slow motion as it is and turns fast
flanks into straight lines.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "actuator",
    "velocity_limit",
    {
        "velocity_limit": Parameter(
            "velocity",
            "m/s",
            null=math.inf,
            least=0.001,
            most=5.0,
            sizes=(0.036, 0.03, 0.022, 0.015),
            says="highest speed",
        ),
    },
    says="the piston has a highest speed",
    reference="Merritt, Hydraulic Control Systems, Wiley 1967",
    timed=True,
)
