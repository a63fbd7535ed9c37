"""Cracks close: little stiffness around the origin, more farther out.

    f = (1 − factor·w + hardening·(1 − w))·f_column,    w = exp(−(δ/width)²)

`width` is the deformation at which the reduction has fallen to 1/e of that at the origin. With factor 0 there is no
pinching and no hardening. With `law` 1 cracks close more slowly, with a reduction that has tails:

    w = (1 + (δ/width)²/tails)^(−tails),

of which law 0 is the limit for large `tails`. Not to be confused with `column.slip`, which has a
sharp edge and no force within it, or with `actuator.backlash`.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

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
    further={
        "pinching_law": which_law(1.0, "0 the reduction is a bell without tails, 1 with tails"),
        "pinching_tails": Parameter(
            "tails",
            "",
            null=2.0,
            least=0.5,
            most=20.0,
            sizes=(),
            says="exponent of the tails of law 1: the smaller, the slower they fall",
            shape=True,
        ),
    },
    laws=(
        Law("without tails", {"width": 0.001, "hardening": 0.1}),
        Law("with tails", {"width": 0.001, "hardening": 0.1, "tails": 2.0}),
    ),
    says="low stiffness until cracks have closed",
    reference="f = (1 − factor·w + hardening·(1 − w))·f_column, w = exp(−(δ/width)²); Student's bell as law 1",
)
