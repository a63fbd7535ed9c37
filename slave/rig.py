"""Laboratory B, emulated: shaking table, active mass damper and their sensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from common import schema
from common.plan import Damper, Sensors, Table
from common.rig import TableCommand, TableMeasurement
from models.labs import noise, table_lab


class TableLab:
    """The emulated laboratory; options are the plan's tables `table`, `damper` and `sensors`."""

    def __init__(
        self,
        interval: float,
        seed: int,
        table: Mapping[str, Any] | None = None,
        damper: Mapping[str, Any] | None = None,
        sensors: Mapping[str, Any] | None = None,
    ) -> None:
        self._arrays = table_lab.build(
            interval,
            schema.fill(Table, table or {}, "table"),
            schema.fill(Damper, damper or {}, "damper"),
        )
        self._noise = noise.Noise(seed, noise.levels_b(schema.fill(Sensors, sensors or {}, "sensors")))
        self._true = (0.0, 0.0, 0.0, 0.0)
        self._advance = table_lab.advance

    def arm(self) -> None:
        """Nothing can hinder an emulated laboratory."""

    def read(self) -> TableMeasurement:
        """Readings at the present tick, with the sensors' noise."""
        error, true = self._noise.row(), self._true
        return TableMeasurement(
            true[0] + error[0], true[1] + error[1], true[2] + error[2], true[3] + error[3]
        )

    def write(self, command: TableCommand) -> None:
        """Move on by one interval: the table ramps to its command, the motor holds its own."""
        self._true = self._advance(*self._arrays, command.table_command, command.damper_command)

    def disarm(self) -> None:
        """An emulated table stays where it is; the motor's force is its command's."""
