"""Laboratory A on its ramp to rest: the actuator comes to a hold, then unloads the specimen."""

from __future__ import annotations

from common.plan.plan import Plan
from common.rig import ColumnCommand, ColumnMeasurement
from common.safety.ramp import MotionRamp


class ColumnRamp:
    """The actuator's commands from the last two written on."""

    def __init__(self, plan: Plan, last: ColumnCommand, before: ColumnCommand) -> None:
        safety, interval = plan.safety, plan.test.interval
        position = last.actuator_command
        velocity = (position - before.actuator_command) / interval
        self._motion = MotionRamp(safety, interval, position, velocity, unload=safety.unload)

    def step(self, measured: ColumnMeasurement | None) -> ColumnCommand:
        """The command for the coming interval."""
        return ColumnCommand(self._motion.step(measured.column_force if measured else None))

    @property
    def done(self) -> bool:
        """Whether the commands are at rest."""
        return self._motion.done

    @property
    def left(self) -> float:
        """How long it takes at most from here on, s."""
        return self._motion.left

    def doing(self, measured: ColumnMeasurement | None) -> str:
        """What it does, in words, with the force that the specimen still carries."""
        force = "unknown force" if measured is None else f"{abs(measured.column_force) * 1e-3:.1f} kN"
        if self._motion.unloading:
            return f"unloading the column: {force} left"
        return f"bringing the actuator to a halt: {force} on the column"

    @property
    def travel(self) -> float:
        """How far apart they have been, m."""
        return self._motion.travel
