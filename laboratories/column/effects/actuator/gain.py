"""The actuator's displacement is larger or smaller than commanded: calibration of the servo loop.

    T·ẏ + y = factor·K·u(t − L)

or the same factor on the command of servo-hydraulics. Not to be confused with a wrong displacement reading
(`sensor.column_displacement.gain`), under which the force per true displacement stays right but the force
per reading does not.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on
from models.system import System


def apply(system: System, factor: float) -> System:
    """Static gain multiplied by `factor`."""
    servo = system.plan.actuator.model == "servo_hydraulic"
    return system.scaled("actuator", "servo.gain" if servo else "gain", factor)


EFFECT = factor_on(
    "actuator",
    "gain",
    apply,
    says="the actuator's displacement is larger or smaller than commanded",
    reference="T·ẏ + y = factor·K·u(t − L)",
    bounds=(0.2, 3.0),
    sizes=(0.85, 0.93, 0.97, 1.03, 1.07, 1.15),
)
