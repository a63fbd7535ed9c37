"""Friction in the set-up (tension bars, slides), which the load cell measures.

    f = f_column + force·s/presliding,    ṡ = δ̇ while |s| < presliding, else s stays

It acts as a spring that slides at `force`; before it slides, the contact deforms by `presliding` to either side. With
`law` 1 the force is larger by the share `asymmetry` in the positive direction and smaller by it in the negative one,
and decreases by the share `drop` at high speed. With `law` 2 the specimen itself is a slider, as in a friction damper:
it takes the place of the planned specimen, unless `column.yielding` or
`column.self_centring` does, behind a joint of `stiffness`, whose play is `column.slip`
(`models/specimens/slider.py`).

Not to be confused with `column.viscous`, whose loop grows with speed, or `column.yielding`, which has no loop at small
amplitude.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.friction import FURTHER, VELOCITY, laws
from laboratories.effects.laws import sets, which_law

BY_SPEED = {name: value for name, value in FURTHER.items() if name}  # the fields of law 1

EFFECT = sets(
    "column",
    "friction",
    {
        "friction": Parameter(
            "force", "N", null=0.0, least=0.0, most=1e7, sizes=(100.0, 300.0, 900.0, 3000.0)
        ),
        "presliding": Parameter(
            "presliding",
            "m",
            null=1e-05,
            least=1e-07,
            most=0.0003,
            sizes=(3e-06, 1e-05, 5e-05),
            says="deformation to either side before it slides",
            shape=True,
        ),
        "friction_velocity": VELOCITY,
    },
    further=BY_SPEED
    | {
        "friction_law": which_law(
            2.0,
            "0 the same in both directions and at all speeds, 1 by direction and speed, "
            "2 a slider in the specimen's place",
        ),
        "friction_stiffness": Parameter(
            "stiffness",
            "N/m",
            null=1e7,
            least=1.0,
            most=1e13,
            sizes=(),
            says="stiffness of the joint of law 2 outside its play",
            shape=True,
        ),
    },
    laws=(
        *laws({"presliding": 1e-5, "velocity": 1e-6}),
        Law(
            "a slider in the specimen's place",
            {"stiffness": 1e7, "asymmetry": 0.0, "drop": 0.1, "speed": 0.02},
            "slider",
            beside={"column.slip": {"gap": "play", "corner": "corner"}},
        ),
    ),
    says="friction in the set-up of the specimen",
    reference="Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083-1138",
)
