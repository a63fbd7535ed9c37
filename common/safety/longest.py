"""How long a laboratory's way to rest takes at most, by the plan."""

from __future__ import annotations

from common.plan import Plan
from common.safety.speed_change import SpeedChange

MARGIN_S = 1.0  # on the way itself, for intervals that are left out


def resting(plan: Plan) -> float:
    """The longest way to rest, s: from the limits of speed to a halt, then from the actuator's limit to no load."""
    safety, limits, interval = plan.safety, plan.limits, plan.test.interval

    def change(speed: float) -> SpeedChange:
        return SpeedChange(speed, 0.0, safety.acceleration, safety.jerk)

    actuator = change(min(limits.actuator_velocity, limits.actuator_step / interval))
    table = change(min(limits.table_velocity, limits.table_step / interval))
    way = limits.actuator_command + actuator.travel(actuator.duration)
    unloading = way / safety.velocity + 2.0 * change(safety.velocity).duration
    longest = max(actuator.duration + unloading, table.duration, safety.release)
    return longest + safety.settle + MARGIN_S
