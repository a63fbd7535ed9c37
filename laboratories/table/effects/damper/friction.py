"""Coulomb friction of the damper's guide rail.

A force of constant size against the stroke's velocity; at rest it balances what is applied, up to that size.
"""

from __future__ import annotations

from laboratories.effects.effect import Effect, Parameter
from laboratories.effects.friction import VELOCITY
from models.system import DamperEffects, System


def apply(system: System, force: float, velocity: float) -> System:
    """Friction of `force` N between moving mass and table."""
    if force == 0.0:
        velocity = DamperEffects.friction_velocity
    return system.laid("damper", friction=force, friction_velocity=velocity)


EFFECT = Effect(
    name="damper.friction",
    site="damper",
    kind="physics",
    says="Coulomb friction of the guide rail",
    parameters=(
        Parameter("force", "N", null=0.0, least=0.0, most=200.0, sizes=(0.3, 1.0, 3.0, 10.0)),
        VELOCITY,
    ),
    reference="Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083-1138",
    apply=apply,
)
