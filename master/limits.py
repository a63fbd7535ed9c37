"""What the master checks before its rig moves: the measurements it read and the commands it computed."""

from __future__ import annotations

from common.plan.limits import Change, Frozen, Guard, Lasting, Standstill, Violation
from common.plan.plan import Plan
from common.rig import ColumnCommand, ColumnMeasurement
from common.signals import OF_STOREYS, SENT
from master.energy import EnergyMonitor
from master.step import Outputs

STOREYS = Outputs._fields.index(OF_STOREYS[0])


class MasterLimits:
    """The plan's limits on laboratory A, on the building, and on what is sent to the slaves.

    `violation` is asked once in every tick; `written` is told of every command that went to the rig.
    """

    def __init__(self, plan: Plan) -> None:
        limits = plan.limits
        several = OF_STOREYS if plan.storeys > 1 else ()
        self._measurements = Guard(limits, ColumnMeasurement._fields)
        self._command = Guard(limits, ("actuator_command",))
        self._sent = Guard(limits, SENT)
        self._storeys = Guard(limits, OF_STOREYS, several)
        self._actuator = Change(
            limits,
            plan.test.interval,
            step="actuator_step",
            velocity="actuator_velocity",
            acceleration="actuator_acceleration",
        )
        self._error = Lasting(limits, "column_error")
        self._energy = EnergyMonitor(plan)
        self._frozen = Frozen(plan, ColumnMeasurement._fields, "column_displacement")
        self._present = 0.0  # command in force over the interval just over

    def violation(self, measured: ColumnMeasurement, outputs: Outputs) -> Violation | Standstill | None:
        """The first value beyond its limit, None where there is none."""
        error = outputs.target - measured.column_displacement
        lasting = self._error.violation(error)
        energy = self._energy.violation(measured, outputs)
        frozen = self._frozen.violation(measured, self._present)
        return (
            self._measurements.violation(measured)
            or self._command.violation((outputs.command,))
            or next(filter(None, map(self._sent.violation, outputs.sent)), None)
            or self._storeys.violation(outputs[STOREYS:])
            or self._actuator.violation(outputs.command)
            or lasting
            or energy
            or frozen
        )

    def written(self, command: ColumnCommand) -> None:
        """The rig was given this command."""
        self._present = command.actuator_command
        self._actuator.written(command.actuator_command)

    def standing(self, measured: ColumnMeasurement) -> str:
        """Why a rig at rest may not be reset, empty where all it reads is within its limits."""
        return str(self._measurements.violation(measured) or "")
