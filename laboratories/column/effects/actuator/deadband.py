"""Overlap of the servo valve: small errors of the loop move no oil.

    T·ẏ = e − clip(e, −width/2, +width/2),    e = K·u(t − L) − y

`width` is the whole band, both signs together. Not to be confused with `actuator.backlash`, a play with
memory behind the piston: the dead band leaves a slow creep short of the target.
"""

from __future__ import annotations

from laboratories.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, width: float) -> System:
    """Whole dead band of `width` m on the loop's error."""
    return system.laid("actuator", deadband=width)


EFFECT = Effect(
    name="actuator.deadband",
    site="actuator",
    kind="physics",
    says="small errors of the loop move no oil",
    parameters=(
        Parameter(
            "width",
            "m",
            null=0.0,
            least=0.0,
            most=0.005,
            sizes=(5e-05, 0.00015, 0.0004, 0.001),
            says="whole band of the error",
        ),
    ),
    reference="Merritt, Hydraulic Control Systems, Wiley 1967",
    apply=apply,
)
