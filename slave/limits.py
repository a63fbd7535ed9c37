"""What the slave checks before its rig moves: the measurements it read and the command it was sent."""

from __future__ import annotations

from common.plan.limits import Change, Frozen, Guard, Lasting, Standstill, Violation
from common.plan.plan import Plan
from common.protocol.messages import Command
from common.rig import TableCommand, TableMeasurement

AT_REST = TableCommand(0.0, 0.0)


class SlaveLimits:
    """The plan's limits on laboratory B.

    `violation` is asked once in every tick; `written` is told of every command that went to the rig.
    """

    def __init__(self, plan: Plan) -> None:
        limits, interval = plan.limits, plan.test.interval
        self._measurements = Guard(limits, TableMeasurement._fields)
        self._command = Guard(limits, Command._fields)
        self._wanted = Guard(limits, TableCommand._fields)
        self._table = Change(limits, interval, step="table_step", velocity="table_velocity")
        self._motor = Change(limits, interval, step="damper_step")
        self._error = Lasting(limits, "table_error")
        self._frozen_table = Frozen(plan, TableMeasurement._fields[:2], "table_displacement")
        self._frozen_damper = Frozen(plan, TableMeasurement._fields[2:], "damper_force")
        self._wrote = AT_REST
        self._target = 0.0  # of the command asked about last
        self._present = 0.0  # of the command that was in force over the interval just over

    def violation(
        self, measured: TableMeasurement, command: Command, wanted: TableCommand
    ) -> Violation | Standstill | None:
        """The first value beyond its limit, None where there is none."""
        self._target = command.table_target
        lasting = self._error.violation(self._present - measured.table_displacement)
        table = self._frozen_table.violation(measured[:2], self._wrote.table_command)
        damper = self._frozen_damper.violation(measured[2:], self._wrote.damper_command)
        return (
            self._measurements.violation(measured)
            or self._command.violation(command)
            or self._wanted.violation(wanted)
            or self._table.violation(wanted.table_command)
            or self._motor.violation(wanted.damper_command)
            or lasting
            or table
            or damper
        )

    def written(self, command: TableCommand) -> None:
        """The rig was given this command, for the target asked about last."""
        self._present = self._target
        self._wrote = command
        self._table.written(command.table_command)
        self._motor.written(command.damper_command)

    def standing(self, measured: TableMeasurement) -> str:
        """Why a rig at rest may not be reset, empty where all it reads is within its limits."""
        return str(self._measurements.violation(measured) or "")
