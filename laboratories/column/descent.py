"""Laboratory A on its ramp to rest: the actuator comes to a hold, then unloads the specimen."""

from __future__ import annotations

from common.plan.plan import Plan
from common.safety.ramp import MotionRamp

FORCE = 1  # place among the measured channels


class ColumnRamp:
    """The actuator's commands from the last two written on."""

    def __init__(self, plan: Plan, last: tuple[float, ...], before: tuple[float, ...]) -> None:
        safety, interval = plan.safety, plan.test.interval
        velocity = (last[0] - before[0]) / interval
        self._motion = MotionRamp(safety, interval, last[0], velocity, unload=safety.unload)

    def step(self, measured: tuple[float, ...] | None) -> tuple[float, ...]:
        """The command for the coming interval."""
        return (self._motion.step(measured[FORCE] if measured else None),)

    @property
    def done(self) -> bool:
        """Whether the commands are at rest."""
        return self._motion.done

    @property
    def left(self) -> float:
        """How long it takes at most from here on, s."""
        return self._motion.left

    def doing(self, measured: tuple[float, ...] | None) -> str:
        """What it does, in words, with the force that the specimen still carries."""
        force = "unknown force" if measured is None else f"{abs(measured[FORCE]) * 1e-3:.1f} kN"
        if self._motion.unloading:
            return f"unloading the column: {force} left"
        return f"bringing the actuator to a halt: {force} on the column"

    @property
    def travel(self) -> float:
        """How far apart they have been, m."""
        return self._motion.travel
