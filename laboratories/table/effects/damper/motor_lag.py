"""The motor's current loop is slower or faster than believed.

    (T_m + time_constant)·u̇ + u = damper_command

The total is at least 0. Not to be confused with a delay of the command (`link.delay`) or a lag of the force
reading (`sensor.damper_force.lag`), which leaves the stroke as it was.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import adds

EFFECT = adds(
    "damper",
    "motor_lag",
    "motor_time_constant",
    Parameter(
        "time_constant",
        "s",
        null=0.0,
        least=-0.05,
        most=0.2,
        sizes=(-0.002, 0.001, 0.003, 0.008, 0.02),
        says="added",
    ),
    says="the motor's force lags more or less behind its command",
    reference="(T_m + time_constant)·u̇ + u = damper_command",
)
