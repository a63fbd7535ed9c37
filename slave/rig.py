"""Laboratory B, emulated: shaking table, active mass damper and their sensors."""

from __future__ import annotations

from collections.abc import Mapping
from operator import add
from typing import Any

from common.plan import schema
from common.plan.tables import Damper, Sensors, Table
from common.rig import TableCommand, TableMeasurement
from laboratories.sensors import noise, readings
from laboratories.table import model as table_lab
from laboratories.table.kind import TABLE
from models.compiled import plain
from models.system import Effects


class TableLab:
    """The emulated laboratory; options are the plan's tables `table`, `damper` and `sensors`, and effects."""

    def __init__(
        self,
        interval: float,
        seed: int,
        table: Mapping[str, Any] | None = None,
        damper: Mapping[str, Any] | None = None,
        sensors: Mapping[str, Any] | None = None,
        effects: Effects | None = None,
    ) -> None:
        more = effects or Effects()
        levels = noise.levels(schema.fill(Sensors, sensors or {}, "sensors"), TABLE.channels.names)
        lab = table_lab.build(
            interval,
            schema.fill(Table, table or {}, "table"),
            schema.fill(Damper, damper or {}, "damper"),
            more.table,
            more.damper,
        )
        self._lab = plain(lab)
        self._readings = readings.build(interval, TABLE.channels.names, more.sensors)
        self._noise = noise.Noise(seed, readings.levels(TABLE.channels.names, levels, more.sensors))
        self._plain = not more.sensors  # a reading is value plus noise
        self._interval, self._tick = interval, 0
        self._true = (0.0, 0.0, 0.0, 0.0)
        self._advance = table_lab.enter

    def arm(self) -> None:
        """An emulated laboratory is always ready."""

    def read(self) -> TableMeasurement:
        """Readings at the present tick, with the sensors' noise."""
        error, true, sensors = self._noise.row(), self._true, self._readings
        if self._plain:
            return TableMeasurement(*map(add, true, error))
        t = self._tick * self._interval
        self._tick += 1
        return TableMeasurement(
            *(readings.step(sensors, place, true[place], error[place], t) for place in range(len(true)))
        )

    def write(self, command: TableCommand) -> None:
        """Move on by one interval: the table ramps to its command, the motor holds its own."""
        self._true = self._advance(self._lab, command.table_command, command.damper_command)

    def disarm(self) -> None:
        """An emulated table stays where it is; the motor's force is its command's."""
