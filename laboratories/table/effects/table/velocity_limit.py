"""The table's valve saturates: its loop has a highest speed.

    ÿ = 2ζω·(L(ω/(2ζ)·(u − y)) − ẏ),   L(v) = clip(v, −velocity, +velocity)

The valve's opening follows the error of the loop, and its flow reaches the piston by a lag of 1/(2ζω). Without the
limit this is the loop of second order. With `law` 1 the valve opens ever less: L(v) = v/(1 + |v/velocity|ⁿ)^(1/n) with
n = sharpness. Not to be confused with `table.bandwidth`, which also slows down small motions.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import bend_sharpness, sets, which_law

EFFECT = sets(
    "table",
    "velocity_limit",
    {
        "velocity_limit": Parameter(
            "velocity",
            "m/s",
            null=math.inf,
            least=0.001,
            most=10.0,
            sizes=(0.2, 0.12, 0.08, 0.05),
            says="highest speed",
            bends_by="sharpness",
        ),
    },
    further={
        "": which_law(1.0, "0 suddenly, 1 gradually"),
        "velocity_limit_sharpness": bend_sharpness("how suddenly the speed bends at its limit under law 1"),
    },
    laws=(Law("sudden", {}), Law("gradual", {"sharpness": 3.0})),
    says="the table's valve saturates at a speed",
    reference="Merritt, Hydraulic Control Systems, Wiley 1967",
)
