"""Oil column and reaction frame give way: the specimen gets less displacement the more it resists.

    y = y_piston − compliance · f

Not to be confused with `actuator.gain`: a linear specimen makes both a factor on the displacement,
1/(1 + compliance·k); the compliance goes with the force and is gone where the force is.
"""

from __future__ import annotations

from laboratories.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, compliance: float) -> System:
    """Yielding by `compliance` m per newton of the specimen's force."""
    return system.laid("actuator", compliance=compliance)


EFFECT = Effect(
    name="actuator.compliance",
    site="actuator",
    kind="physics",
    says="the piston yields under the specimen's force",
    parameters=(
        Parameter("compliance", "m/N", null=0.0, least=0.0, most=1e-06, sizes=(1e-09, 3e-09, 1e-08, 3e-08)),
    ),
    reference="Merritt, Hydraulic Control Systems, Wiley 1967",
    apply=apply,
)
