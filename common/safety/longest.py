"""How long a laboratory's ramp to rest takes at most, by the plan."""

from __future__ import annotations

import math

from common.plan.plan import Plan
from common.plan.tables import Limits
from common.safety.speed_change import SpeedChange

MARGIN_S = 1.0  # on the way itself, for intervals that are left out


def resting(plan: Plan) -> float:
    """The longest ramp to rest, s: from the limits of speed to a halt, then from the actuator's limit to no load."""
    safety, limits = plan.safety, plan.limits

    def change(speed: float) -> SpeedChange:
        return SpeedChange(speed, 0.0, safety.acceleration, safety.jerk)

    actuator, table = change(fastest(plan, "actuator")), change(fastest(plan, "table"))
    way = limits.actuator_command + actuator.travel(actuator.duration)
    unloading = way / safety.velocity + 2.0 * change(safety.velocity).duration
    longest = max(actuator.duration + unloading, table.duration, safety.release)
    return longest + safety.settle + MARGIN_S


def fastest(plan: Plan, part: str) -> float:
    """The largest speed of a part's command, m/s; without a limit on it that which holds where none is written out.

    The halt from there is a small part of the longest ramp to rest, so that a faster command is covered too.
    """
    for limits in (plan.limits, Limits()):
        speed = min(getattr(limits, f"{part}_velocity"), getattr(limits, f"{part}_step") / plan.test.interval)
        if math.isfinite(speed):
            return float(speed)
    raise AssertionError(f"The standard limits of the {part} bound no speed.")
