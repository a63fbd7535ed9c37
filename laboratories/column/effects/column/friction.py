"""Rubbing in the set-up (tension bars, slides), felt by the load cell.

    f = f_column + force·s/presliding,    ṡ = δ̇ while |s| < presliding, else s stays

A spring that slides at `force`: before it does, the contact deforms by `presliding` to one side. Not to
be confused with `column.viscous`, whose loop grows with speed, or `column.yielding`, which has no loop at
small amplitude.
"""

from __future__ import annotations

from laboratories.effects.effect import Effect, Parameter
from laboratories.effects.friction import VELOCITY
from models.system import ColumnEffects, System


def apply(system: System, force: float, presliding: float, velocity: float) -> System:
    """Friction of `force` N after `presliding` m; without it the shape leaves no trace."""
    if force == 0.0:
        presliding, velocity = ColumnEffects.presliding, ColumnEffects.friction_velocity
    return system.laid("column", friction=force, presliding=presliding, friction_velocity=velocity)


EFFECT = Effect(
    name="column.friction",
    site="column",
    kind="physics",
    says="rubbing in the set-up of the specimen",
    parameters=(
        Parameter("force", "N", null=0.0, least=0.0, most=30000.0, sizes=(100.0, 300.0, 900.0, 3000.0)),
        Parameter(
            "presliding",
            "m",
            null=1e-05,
            least=1e-07,
            most=0.0003,
            sizes=(3e-06, 1e-05, 5e-05),
            says="deformation before it slides, to one side",
            shape=True,
            default=1e-05,
        ),
        VELOCITY,
    ),
    reference="Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083-1138",
    apply=apply,
)
