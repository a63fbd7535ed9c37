"""Play in the table's drive.

    |u_true − u| ≤ width/2, and u_true moves only when the play is used up

`width` is the whole play, from one flank to the other; it acts before the table's own dynamics. Not to be confused with
`table.friction`, which also distorts reversals, but whose share does not decrease with the amplitude.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "table",
    "backlash",
    {
        "backlash": Parameter(
            "width",
            "m",
            null=0.0,
            least=0.0,
            most=0.02,
            sizes=(3e-05, 0.0001, 0.0004, 0.0015),
            says="whole play",
        ),
    },
    says="play in the table's drive",
    reference="Nordin, Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002) 1633-1649",
)
