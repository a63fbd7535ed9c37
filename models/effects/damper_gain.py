"""The motor gives more or less force than told: motor constant, calibration of the drive.

    T_m·u̇ + u = factor·damper_command

Not to be confused with `damper.mass`, or with a wrong force reading (`sensor.damper_force.gain`), which
leaves the stroke as it was.
"""

from __future__ import annotations

from models.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, factor: float) -> System:
    """Motor command multiplied by `factor`."""
    return system.laid("damper", gain=factor)


EFFECT = Effect(
    name="damper.gain",
    site="damper",
    kind="physics",
    says="the motor gives more or less force than told",
    parameters=(
        Parameter("factor", "", null=1.0, least=0.0, most=3.0, sizes=(0.85, 0.93, 0.97, 1.03, 1.07, 1.15)),
    ),
    reference="T_m·u̇ + u = factor·damper_command",
    apply=apply,
)
