"""Cracks close: little stiffness around the origin, more farther out.

    f = (1 − factor·w + hardening·(1 − w))·f_column,    w = exp(−(δ/width)²)

`width` is the deformation at which the reduction has fallen to 1/e of that at the origin. With factor 0 there is no
pinching and no hardening. Not to be confused with `column.slip`, which has a sharp edge and no force within it, or with
`actuator.backlash`.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "column",
    "pinching",
    {
        "pinching": Parameter(
            "factor",
            "",
            null=0.0,
            least=0.0,
            most=0.95,
            sizes=(0.05, 0.15, 0.35, 0.6),
            says="share of the force missing at the origin",
        ),
        "pinching_hardening": Parameter(
            "hardening",
            "",
            null=0.0,
            least=0.0,
            most=0.3,
            sizes=(0.0, 0.1, 0.3),
            says="share of the force added at large deformation",
            shape=True,
        ),
        "pinching_width": Parameter(
            "width",
            "m",
            null=0.001,
            least=1e-05,
            most=0.05,
            sizes=(0.0003, 0.001, 0.003),
            says="deformation at which 1/e of the reduction is left",
            shape=True,
        ),
    },
    says="low stiffness until cracks have closed",
    reference="f = (1 − factor·w + hardening·(1 − w))·f_column, w = exp(−(δ/width)²)",
)
