"""Coulomb friction of the table's bearings.

    ÿ = ω²·(u − y) − 2ζω·ẏ − acceleration·sgn(ẏ)

`acceleration` is the friction force over the moving mass; at rest it balances what is applied, up to that
size. Not to be confused with `table.backlash`: friction shows as spikes of acceleration at reversals.
"""

from __future__ import annotations

from laboratories.effects.effect import Effect, Parameter
from laboratories.effects.friction import VELOCITY
from models.system import System, TableEffects


def apply(system: System, acceleration: float, velocity: float) -> System:
    """Friction force of `acceleration` m/s² times the moving mass."""
    if acceleration == 0.0:
        velocity = TableEffects.friction_velocity
    return system.laid("table", friction=acceleration, friction_velocity=velocity)


EFFECT = Effect(
    name="table.friction",
    site="table",
    kind="physics",
    says="Coulomb friction of the table's bearings",
    parameters=(
        Parameter(
            "acceleration",
            "m/s²",
            null=0.0,
            least=0.0,
            most=10.0,
            sizes=(0.03, 0.1, 0.3, 1.0),
            says="friction force over moving mass",
        ),
        VELOCITY,
    ),
    reference="Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083-1138",
    apply=apply,
)
