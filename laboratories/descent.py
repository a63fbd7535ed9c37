"""The ramp to rest of a laboratory that deforms a specimen: to a hold, then the specimen is unloaded."""

from __future__ import annotations

from common.plan.plan import Plan
from common.safety.ramp import MotionRamp


class HoldRamp:
    """The commands of the ramp, from the last two written on.

    Args:
        plan: of the role that hosts the laboratory; it states whether the specimen is unloaded after the hold.
        last: the last commands written, the displacement first.
        before: the commands one interval earlier.
        force: index of the specimen's force among the measured channels.
        moved: name of the transfer system, for messages.
        tested: name of the specimen, for messages.
        rest: the other commands during the ramp.
    """

    def __init__(
        self,
        plan: Plan,
        last: tuple[float, ...],
        before: tuple[float, ...],
        force: int,
        moved: str,
        tested: str,
        rest: tuple[float, ...] = (),
    ) -> None:
        safety, interval = plan.safety, plan.test.interval
        velocity = (last[0] - before[0]) / interval
        self._motion = MotionRamp(safety, interval, last[0], velocity, unload=safety.unload)
        self._force, self._moved, self._tested, self._rest = force, moved, tested, rest

    def step(self, measured: tuple[float, ...] | None) -> tuple[float, ...]:
        """The commands for the coming interval."""
        return (self._motion.step(measured[self._force] if measured else None), *self._rest)

    @property
    def done(self) -> bool:
        """Whether the command is at rest."""
        return self._motion.done

    @property
    def left(self) -> float:
        """The longest remaining time, s."""
        return self._motion.left

    def doing(self, measured: tuple[float, ...] | None) -> str:
        """The present phase in words, with the force that the specimen still carries."""
        force = "unknown force" if measured is None else f"{abs(measured[self._force]) * 1e-3:.1f} kN"
        if self._motion.unloading:
            return f"unloading the {self._tested}: {force} left"
        if self._motion.holding:
            return f"waiting for the {self._moved} to settle: {force} on the {self._tested}"
        return f"bringing the {self._moved} to a halt: {force} on the {self._tested}"

    @property
    def travel(self) -> float:
        """The distance between the largest and the smallest command, m."""
        return self._motion.travel
