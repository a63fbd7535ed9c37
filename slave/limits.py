"""What the slave checks before its rig moves: the measurements it read and the command it was sent."""

from __future__ import annotations

from common.limits import Guard
from common.messages import Command
from common.rig import TableCommand, TableMeasurement
from common.tables import Limits


class SlaveLimits:
    """The plan's limits on laboratory B."""

    def __init__(self, limits: Limits) -> None:
        self._measurements = Guard(limits, TableMeasurement._fields)
        self._command = Guard(limits, Command._fields)
        self._written = Guard(limits, TableCommand._fields)

    def violation(self, measured: TableMeasurement, command: Command, wanted: TableCommand) -> str:
        """A sentence on the first value beyond its limit, empty where there is none."""
        return (
            self._measurements.violation(measured)
            or self._command.violation(command)
            or self._written.violation(wanted)
        )

    def standing(self, measured: TableMeasurement) -> str:
        """Why a rig at rest may not be reset, empty where all it reads is within its limits."""
        return self._measurements.violation(measured)
