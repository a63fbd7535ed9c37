"""Coulomb friction of the damper's guide rail.

A force of constant size against the stroke's velocity; at rest it balances the applied force up to that size.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.friction import FURTHER, VELOCITY, laws
from laboratories.effects.laws import sets

EFFECT = sets(
    "damper",
    "friction",
    {
        "friction": Parameter("force", "N", null=0.0, least=0.0, most=200.0, sizes=(0.3, 1.0, 3.0, 10.0)),
        "friction_velocity": VELOCITY,
    },
    further=FURTHER,
    laws=laws({"velocity": 1e-6}),
    says="Coulomb friction of the guide rail",
    reference="Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083-1138",
)
