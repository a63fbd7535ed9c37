"""Flow saturation of the servo valve: the piston has a highest speed.

    |ẏ| ≤ velocity

Of servo-hydraulics it is the flow that ends, at what moves the piston as fast without a load: `|q| ≤ a2·velocity`.
Not to be confused with a slower servo loop, which smooths every motion; this one leaves slow motion as it
is and cuts fast flanks to straight lines.
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
)
