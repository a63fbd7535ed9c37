"""The specimen permanently loses stiffness with its largest deformation so far.

    f = (1 − rate·(1 − exp(−δ_max/δ_ref)))·f_column,    δ_max = largest |δ| so far, δ_ref = 2 mm

`rate` is the share that is lost in the end. Not to be confused with `column.yielding`, which dissipates
in every cycle, or `column.stiffness`, which is there from the beginning.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "column",
    "degradation",
    {
        "degradation": Parameter(
            "rate",
            "",
            null=0.0,
            least=0.0,
            most=0.95,
            sizes=(0.03, 0.08, 0.2, 0.4),
            says="share lost at large deformation",
        ),
    },
    says="stiffness is lost with the largest deformation so far",
    reference="f = (1 − rate·(1 − exp(−δ_max/2 mm)))·f_column",
)
