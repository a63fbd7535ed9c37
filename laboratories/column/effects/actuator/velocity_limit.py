"""Flow saturation of the servo valve: the piston has a highest speed.

    |ẏ| ≤ velocity

With `law` 1 the valve opens ever less: v/(1 + |v/velocity|ⁿ)^(1/n) with n = sharpness and the velocity v of a valve
without limit. With `law` 2 the load f takes from the pressure across the valve, up to the stall force:

    |ẏ| ≤ velocity·√(1 − sgn(ẏ)·f/stall)

For servo-hydraulics the flow is limited to that of an unloaded piston at this speed: `|q| ≤ a2·velocity`, and there is
no law 1, because the flow is a state of the valve. Not to be
confused with a slower servo loop, which smooths every motion; this effect leaves slow motion as it is and turns fast
flanks into straight lines.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import bend_sharpness, sets, which_law

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
            bends_by="sharpness",
        ),
    },
    further={
        "": which_law(2.0, "0 suddenly, 1 gradually, 2 at a speed that falls with the load"),
        "velocity_limit_sharpness": bend_sharpness("how suddenly the speed bends at its limit under law 1"),
        "stall_force": Parameter(
            "stall",
            "N",
            null=math.inf,
            least=100.0,
            most=1e8,
            sizes=(1e5, 3e5),
            says="load at which the piston of law 2 stands",
            shape=True,
        ),
    },
    laws=(Law("sudden", {}), Law("gradual", {"sharpness": 3.0}), Law("under load", {"stall": 1e5})),
    says="the piston has a highest speed",
    reference="Merritt, Hydraulic Control Systems, Wiley 1967",
    timed=True,
)
