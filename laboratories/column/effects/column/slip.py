"""Loose fixture: within a gap the specimen moves without any force.

    f = f_column(δ'),    δ' = δ − clip(δ, −gap/2, +gap/2)

`gap` is the whole gap, from one contact to the other, around the origin. Not to be confused with
`actuator.backlash`, where the specimen does not move, or `column.pinching`, which has no edge.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "column",
    "slip",
    {
        "slip": Parameter(
            "gap",
            "m",
            null=0.0,
            least=0.0,
            most=0.005,
            sizes=(2e-05, 6e-05, 0.0002, 0.0006),
            says="whole gap",
        ),
    },
    says="no force within a gap",
    reference="f = f_column(δ − clip(δ, ±gap/2))",
)
