"""The motor's current loop is slower or faster than planned.

    T·u̇ + u = damper_command,    T = T_m + time_constant

The total T is at least 0. The parameter `law` chooses another formula:

    1   a loop of second order, as late for slow commands: (T/2ζ)²·ü + T·u̇ + u = damper_command,    ζ = damping

Not to be confused with a delay of the command (`link.delay`) or a lag of the force reading
(`sensor.damper_force.lag`), which leaves the stroke as it was.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Effect, Law
from laboratories.effects.laws import added, extra_time, of_second_order, which_law
from models.system import System


def late(system: System, time_constant: float, law: float = 0.0, damping: float = math.inf) -> System:
    """The system with a time (s) added to the motor's time constant, and the damping ratio of law 1."""
    system = added(system, table="damper", key="motor_time_constant", time_constant=time_constant)
    second = law != 0.0 and time_constant != 0.0
    return system.laid("damper", motor_damping=damping) if second else system


EFFECT = Effect(
    name="damper.motor_lag",
    site="damper",
    kind="physics",
    says="the motor's force lags more or less behind its command",
    parameters=(extra_time("time_constant", (-0.002, 0.001, 0.003, 0.008, 0.02)),),
    reference="(T_m + time_constant)·u̇ + u = damper_command",
    apply=late,
    further=(which_law(1.0, "0 of first order, 1 of second order"), of_second_order()),
    laws=(Law("of first order", {}), Law("of second order", {"damping": 0.7})),
)
