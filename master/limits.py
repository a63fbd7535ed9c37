"""What the master checks before its rig moves: the measurements it read and the commands it computed."""

from __future__ import annotations

from common.limits import Guard
from common.rig import ColumnMeasurement
from common.tables import Limits
from master.step import Outputs


class MasterLimits:
    """The plan's limits on laboratory A and on what is sent to the slaves."""

    def __init__(self, limits: Limits, storeys: int, slaves: int) -> None:
        per_storey = ("displacement", "velocity", "acceleration") if storeys > 1 else ()
        per_slave = Outputs._fields[3:8] if slaves > 1 else ()  # what is sent to each
        self._measurements = Guard(limits, ColumnMeasurement._fields)
        self._outputs = Guard(limits, Outputs._fields, (*per_storey, *per_slave))

    def violation(self, measured: ColumnMeasurement, outputs: Outputs) -> str:
        """A sentence on the first value beyond its limit, empty where there is none."""
        return self._measurements.violation(measured) or self._outputs.violation(outputs)

    def standing(self, measured: ColumnMeasurement) -> str:
        """Why a rig at rest may not be reset, empty where all it reads is within its limits."""
        return self._measurements.violation(measured)
