"""Coulomb friction of the table's bearings.

    ÿ = ω²·(u − y) − 2ζω·ẏ − acceleration·sgn(ẏ)

`acceleration` is the friction force over the moving mass; at rest it balances the applied force up to that size. The
parameter `law` chooses another formula, as of `damper.friction`: 1 by direction and speed, 2 with presliding (the
balls of a linear bearing roll up over a distance before they roll on: P. R. Dahl, AIAA Journal 14 (1976), 1675-1682),
3 all of it.

Not to be confused with `table.backlash`: friction causes spikes of acceleration at reversals, which presliding rounds.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.friction import BRISTLED, VELOCITY, bristled
from laboratories.effects.laws import sets

EFFECT = sets(
    "table",
    "friction",
    {
        "friction": Parameter(
            "acceleration",
            "m/s²",
            null=0.0,
            least=0.0,
            most=10.0,
            sizes=(0.03, 0.1, 0.3, 1.0),
            says="friction force over moving mass",
        ),
        "friction_velocity": VELOCITY,
    },
    further=BRISTLED,
    laws=bristled(),
    says="Coulomb friction of the table's bearings",
    reference="Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083-1138",
)
