"""Dead time of the actuator beyond the plan's: servo valve, controller, conversion.

    T·ẏ + y = K·u(t − L − delay)

or the same dead time on the command of servo-hydraulics. The total is at least 0. Not to be confused with
`actuator.time_constant`, which delays slow motion in the same way but also reduces the amplitude of fast motion, or
with negative damping of the specimen: c = −k·delay in the loop.
"""

from __future__ import annotations

from dataclasses import replace

from laboratories.effects.effect import Effect
from laboratories.effects.laws import added, extra_time
from models.system import System


def apply(system: System, delay: float) -> System:
    """Dead time longer by `delay` s, in total not below 0."""
    actuator = system.plan.actuator
    if actuator.model == "servo_hydraulic":
        servo = replace(actuator.servo, delay=max(actuator.servo.delay + delay, 0.0))
        return system.moved("actuator", servo=servo)
    return added(system, table="actuator", key="delay", delay=delay)


EFFECT = Effect(
    name="actuator.delay",
    site="actuator",
    kind="physics",
    says="dead time of the actuator is longer or shorter",
    parameters=(extra_time("delay", (-0.008, -0.002, 0.002, 0.005, 0.01, 0.02)),),
    reference="Horiuchi, Inoue, Konno, Namita, Earthq. Eng. Struct. Dyn. 28 (1999) 1121-1141",
    apply=apply,
    timed=True,
)
