"""A constant force on the damper's moving mass: a rail that is not level, a cable, an offset of the drive.

    m·(s̈ + ÿ) = … + force

Its reaction acts on the table. Not to be confused with `sensor.damper_force.bias`, which moves nothing.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "damper",
    "offset",
    {
        "offset": Parameter(
            "force",
            "N",
            null=0.0,
            least=-500.0,
            most=500.0,
            sizes=(-3.0, -0.5, -0.1, 0.1, 0.5, 3.0),
            says="along +x",
        ),
    },
    says="a constant force on the moving mass",
    reference="m·(s̈ + ÿ) = … + force",
)
