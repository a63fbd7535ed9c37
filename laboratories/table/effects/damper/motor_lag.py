"""The motor's current loop is slower or faster than believed.

    (T_m + time_constant)·u̇ + u = damper_command

The total is at least 0. Not to be confused with a delay of the command (`link.delay`) or a lag of the force
reading (`sensor.damper_force.lag`), which leaves the stroke as it was.
"""

from __future__ import annotations

from laboratories.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, time_constant: float) -> System:
    """Motor lag longer by `time_constant` s, in total not below 0."""
    total = max(system.plan.damper.motor_time_constant + time_constant, 0.0)
    return system.moved("damper", motor_time_constant=total)


EFFECT = Effect(
    name="damper.motor_lag",
    site="damper",
    kind="physics",
    says="the motor's force lags more or less behind its command",
    parameters=(
        Parameter(
            "time_constant",
            "s",
            null=0.0,
            least=-0.05,
            most=0.2,
            sizes=(-0.002, 0.001, 0.003, 0.008, 0.02),
            says="added",
        ),
    ),
    reference="(T_m + time_constant)·u̇ + u = damper_command",
    apply=apply,
)
