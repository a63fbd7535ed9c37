"""Oil column and reaction frame give way: the specimen gets less displacement the more it resists.

    y = y_piston − compliance · f

Not to be confused with `actuator.gain`: a linear specimen makes both a factor on the displacement,
1/(1 + compliance·k); the compliance goes with the force and is gone where the force is.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "actuator",
    "compliance",
    {
        "compliance": Parameter(
            "compliance", "m/N", null=0.0, least=0.0, most=1e-06, sizes=(1e-09, 3e-09, 1e-08, 3e-08)
        ),
    },
    says="the piston yields under the specimen's force",
    reference="Merritt, Hydraulic Control Systems, Wiley 1967",
)
