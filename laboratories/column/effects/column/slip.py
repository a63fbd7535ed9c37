"""The fixture has a gap, within which the specimen moves without any force.

    f = f_column(δ'),    δ' = δ − clip(δ, −gap/2, +gap/2)

`gap` is the whole gap, from one contact to the other. The parameter `law` says where it lies:

    0   around the origin
    1   where the specimen rests: δ' follows the contact that loads the specimen until the force is zero, and stays
        there until a contact is reached again, so that the gap moves along with a specimen that yields
    2   where the specimen is held by friction: δ' stays where the motion reverses until the gap is used up (the play
        operator of control engineering)
    3   beside a part without a gap, which has the share 1 − `share` of the stiffness k and also acts inside the gap:
        f = f_column(δ') + (1 − share)·k·(δ − δ')
    4   around the origin, with round corners of the length `corner`

Before a slider (`column.friction` with law 2) the gap lies in the slider's joint and moves along with it.

Not to be confused with `actuator.backlash`, where the actuator's motion itself has play, or `column.pinching`, whose
transition is smooth.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

EFFECT = sets(
    "column",
    "slip",
    {
        "slip": Parameter(
            "gap",
            "m",
            null=0.0,
            least=0.0,
            most=0.2,
            sizes=(2e-05, 6e-05, 0.0002, 0.0006),
            says="whole gap",
            swallows=True,
        ),
    },
    further={
        "slip_law": which_law(
            4.0,
            "0 around the origin, 1 where the specimen rests, 2 where friction holds it, 3 beside a gapless part, "
            "4 with round corners",
        ),
        "slip_share": Parameter(
            "share",
            "",
            null=1.0,
            least=0.01,
            most=1.0,
            sizes=(),
            says="share of the stiffness that lies behind the gap of law 3",
            shape=True,
        ),
        "slip_corner": Parameter(
            "corner",
            "m",
            null=1e-5,
            least=1e-7,
            most=0.05,
            sizes=(),
            says="length over which the gap of law 4 closes",
            shape=True,
        ),
    },
    laws=(
        Law("around the origin", {}),
        Law("where the specimen rests", {}),
        Law("where the specimen is held", {}),
        Law("beside a part without play", {"share": 0.5}),
        Law("with round corners", {"corner": 1e-5}),
    ),
    says="no force within a gap",
    reference="f = f_column(δ − clip(δ, ±gap/2))",
)
