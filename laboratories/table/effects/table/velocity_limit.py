"""The table's valve saturates: its loop has a highest speed.

    ÿ = 2ζω·(clip(ω/(2ζ)·(u − y), −velocity, +velocity) − ẏ)

The valve's opening follows the error of the loop, and its flow reaches the piston by a lag of 1/(2ζω). Without the
limit this is the loop of second order. Not to be confused with `table.bandwidth`, which also slows down small motions.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "table",
    "velocity_limit",
    {
        "velocity_limit": Parameter(
            "velocity", "m/s", null=math.inf, least=0.001, most=10.0, sizes=(0.2, 0.12, 0.08, 0.05)
        ),
    },
    says="the table's valve saturates at a speed",
    reference="Merritt, Hydraulic Control Systems, Wiley 1967",
)
