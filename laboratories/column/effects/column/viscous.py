"""The specimen's force depends on the rate of deformation.

    f = f_column + coefficient·δ̇

Not to be confused with a lag of the load cell or of the displacement reading, which gives a linear specimen the same
loop; nor with `column.friction`, whose force does not grow with speed.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "column",
    "viscous",
    {
        "viscous": Parameter(
            "coefficient",
            "N·s/m",
            null=0.0,
            least=0.0,
            most=2000000.0,
            sizes=(3000.0, 10000.0, 40000.0, 150000.0),
        ),
    },
    says="force that grows with the rate of deformation",
    reference="f = f_column + coefficient·δ̇",
)
