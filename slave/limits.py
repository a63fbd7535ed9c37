"""The limits that a slave checks at each tick, on the measurements read and on the command received."""

from __future__ import annotations

from common.plan.limits import LimitViolation, Standstill
from common.plan.plan import Plan
from common.protocol.messages import Command
from laboratories.kind import Kind
from laboratories.limits import TickLimits, of_commands, of_readings, of_sent

TARGET = Command._fields.index("target")


class SlaveLimits:
    """The limits of a slave's laboratory, as its own plan has them.

    `violation` must be called once in every tick, and `written` with every command that is written to the rig.
    """

    def __init__(self, kind: Kind, plan: Plan) -> None:
        before = [*of_readings(kind, plan), *of_sent(kind, plan)]
        self._tick = TickLimits(kind, plan, [*before, *of_commands(kind, plan)], commands=len(before))
        self._target = 0.0  # target of the command that was checked last
        self._present = 0.0  # target of the command that was in force over the last interval
        self.standing = self._tick.standing

    def violation(
        self, measured: tuple[float, ...], command: Command, wanted: tuple[float, ...]
    ) -> LimitViolation | Standstill | None:
        """The first value beyond its limit, None where there is none."""
        self._target = command.target
        return self._tick.violation(self._present, *measured, *command[TARGET:], *wanted)

    def written(self, command: tuple[float, ...]) -> None:
        """Take note of a command that was written to the rig for the target checked last."""
        self._present = self._target
        self._tick.written(command)
