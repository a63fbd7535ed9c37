"""Compliance of oil column and reaction frame: the specimen's force reduces its displacement.

    y = y_piston − compliance · f

With `law` 1 the force acts within the servo loop, because the flow of a valve falls with the load pressure:

    T·ẏ = K·u(t − L) − y − compliance · f

Under a linear specimen of stiffness k this loop is also faster, by 1 + compliance·k.

Not to be confused with `actuator.gain`: with a linear specimen both are a factor on the displacement, here
1/(1 + compliance·k); the effect of the compliance is proportional to the force and vanishes with it.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

EFFECT = sets(
    "actuator",
    "compliance",
    {
        "compliance": Parameter(
            "compliance", "m/N", null=0.0, least=0.0, most=1e-06, sizes=(1e-09, 3e-09, 1e-08, 3e-08)
        ),
    },
    further={
        "compliance_law": which_law(
            1.0, "0 between piston and specimen, behind the servo loop, 1 within the loop, whose flow falls"
        )
    },
    laws=(Law("behind the loop", {}), Law("within the loop", {})),
    says="the piston gives way under the specimen's force",
    reference="Merritt, Hydraulic Control Systems, Wiley 1967",
)
