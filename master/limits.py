"""What the master checks before its rig moves: the measurements it read and the commands it computed."""

from __future__ import annotations

from common.limits import Guard
from common.plan import Limits
from common.rig import ColumnMeasurement
from master.step import Outputs


class MasterLimits:
    """The plan's limits on laboratory A and on what is sent to the slaves."""

    def __init__(self, limits: Limits, storeys: int, slaves: int) -> None:
        per_storey = ("displacement",) if storeys > 1 else ()
        per_slave = ("table_target", "damper_command") if slaves > 1 else ()
        self._measurements = Guard(limits, ColumnMeasurement._fields)
        self._outputs = Guard(limits, Outputs._fields, (*per_storey, *per_slave))

    def violation(self, measured: ColumnMeasurement, outputs: Outputs) -> str:
        """A sentence on the first value beyond its limit, empty where there is none."""
        return self._measurements.violation(measured) or self._outputs.violation(outputs)
