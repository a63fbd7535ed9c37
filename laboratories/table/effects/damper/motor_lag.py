"""The motor's current loop is slower or faster than planned.

    (T_m + time_constant)·u̇ + u = damper_command

The total is at least 0. Not to be confused with a delay of the command (`link.delay`) or a lag of the force
reading (`sensor.damper_force.lag`), which leaves the stroke as it was.
"""

from __future__ import annotations

from laboratories.effects.laws import adds, extra_time

EFFECT = adds(
    "damper",
    "motor_lag",
    "motor_time_constant",
    extra_time("time_constant", (-0.002, 0.001, 0.003, 0.008, 0.02)),
    says="the motor's force lags more or less behind its command",
    reference="(T_m + time_constant)·u̇ + u = damper_command",
)
