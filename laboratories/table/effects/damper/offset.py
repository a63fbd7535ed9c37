"""A constant force on the damper's moving mass: an offset of the drive, a rail that is not level, a cable.

    m·(s̈ + ÿ) = … + force

The parameter `law` says where its reaction acts:

    0   on the table, as that of a drive. The force on the table has no offset then
    1   elsewhere, as that of gravity along a rail or of a cable. The spring carries the force into the table

Not to be confused with `sensor.damper_force.bias`, which moves nothing.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

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
    further={"offset_outside": which_law(1.0, "where the reaction acts: 0 on the table, 1 elsewhere")},
    laws=(Law("with its reaction on the table", {}), Law("from outside", {})),
)
