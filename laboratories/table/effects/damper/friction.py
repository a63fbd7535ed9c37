"""Coulomb friction of the damper's guide rail.

A force of constant size against the stroke's velocity; at rest it balances the applied force up to that size. The
parameter `law` chooses another formula:

    1   larger by the share `asymmetry` in the positive direction and smaller by it in the negative one, and less by
        the share `drop` at high speed
    2   with presliding (Dahl's law): rail and carriage touch by elastic bristles, which bend before they slide,

            dF/ds = (force·sgn(ds) − F)/presliding

        so that the force of a carriage turned around reaches its size only over a few times that distance; F may depend
        on direction
    3   the same with F by direction and speed

Not to be confused with `damper.viscous`, whose force grows with speed: presliding depends on the way since the last
reversal alone.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.friction import BRISTLED, VELOCITY, bristled
from laboratories.effects.laws import sets

EFFECT = sets(
    "damper",
    "friction",
    {
        "friction": Parameter("force", "N", null=0.0, least=0.0, most=200.0, sizes=(0.3, 1.0, 3.0, 10.0)),
        "friction_velocity": VELOCITY,
    },
    further=BRISTLED,
    laws=bristled(),
    says="Coulomb friction of the guide rail",
    reference="Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083-1138",
)
