"""The ramp to rest of a table laboratory: the table comes to a hold, the damper's motor force to zero."""

from __future__ import annotations

from common.plan.plan import Plan
from common.safety.ramp import ForceRelease, MotionRamp


class TableRamp:
    """The table's and the motor's commands on the ramp, from the last two written on."""

    def __init__(self, plan: Plan, last: tuple[float, ...], before: tuple[float, ...]) -> None:
        safety, interval = plan.safety, plan.test.interval
        velocity = (last[0] - before[0]) / interval
        self._table = MotionRamp(safety, interval, last[0], velocity, unload=False)
        self._motor = ForceRelease(safety, interval, last[1])

    def step(self, measured: tuple[float, ...] | None) -> tuple[float, ...]:
        """The commands for the coming interval, which do not depend on the measurements."""
        return self._table.step(None), self._motor.step()

    @property
    def done(self) -> bool:
        """Whether the table is at rest and the motor without force."""
        return self._table.done and self._motor.done

    @property
    def left(self) -> float:
        """The longest remaining time, s."""
        return max(self._table.left, self._motor.left)

    def doing(self, measured: tuple[float, ...] | None) -> str:
        """The present phase in words, with the motor's remaining force."""
        return f"bringing the table to a halt: {abs(self._motor.command):.0f} N of motor force left"

    @property
    def travel(self) -> float:
        """The distance between the largest and the smallest command of the table, m."""
        return self._table.travel
