"""Play in the clevis between piston and specimen.

    |y_piston − y| ≤ width/2, and y moves only when the play is used up

`width` is the whole play, from one flank to the other. Not to be confused with `column.slip`, where the
specimen moves but gives no force, or with `actuator.deadband`, which acts on the loop's error.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "actuator",
    "backlash",
    {
        "backlash": Parameter(
            "width",
            "m",
            null=0.0,
            least=0.0,
            most=0.005,
            sizes=(2e-05, 6e-05, 0.0002, 0.0006),
            says="whole play",
        ),
    },
    says="play between piston and specimen",
    reference="Nordin, Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002) 1633-1649",
    actuators=("fopdt",),
)
