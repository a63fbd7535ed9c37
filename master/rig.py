"""Laboratory A, emulated: actuator, column and their sensors."""

from __future__ import annotations

from collections.abc import Mapping
from operator import add
from typing import Any

from common.plan import schema
from common.plan.tables import Actuator, Column, Sensors
from common.rig import ColumnCommand, ColumnMeasurement
from laboratories.column import model as column_lab
from laboratories.column.kind import COLUMN
from laboratories.sensors import noise, readings
from models.compiled import plain
from models.system import Effects


class ColumnLab:
    """The emulated laboratory; options are the plan's tables `actuator`, `column` and `sensors`, and effects."""

    def __init__(
        self,
        interval: float,
        seed: int,
        actuator: Mapping[str, Any] | None = None,
        column: Mapping[str, Any] | None = None,
        sensors: Mapping[str, Any] | None = None,
        effects: Effects | None = None,
    ) -> None:
        more = effects or Effects()
        levels = noise.levels(schema.fill(Sensors, sensors or {}, "sensors"), COLUMN.channels.names)
        lab = column_lab.build(
            interval,
            schema.fill(Actuator, actuator or {}, "actuator"),
            schema.fill(Column, column or {}, "column"),
            more.actuator,
            more.column,
        )
        self._lab = plain(lab)
        self._readings = readings.build(interval, COLUMN.channels.names, more.sensors)
        self._noise = noise.Noise(seed, readings.levels(COLUMN.channels.names, levels, more.sensors))
        self._plain = not more.sensors  # a reading is value plus noise
        self._interval, self._tick = interval, 0
        self._true = (0.0, 0.0)
        self._advance = column_lab.enter

    def arm(self) -> None:
        """An emulated laboratory is always ready."""

    def read(self) -> ColumnMeasurement:
        """Readings at the present tick, with the sensors' noise."""
        error, true, sensors = self._noise.row(), self._true, self._readings
        if self._plain:
            return ColumnMeasurement(*map(add, true, error))
        t = self._tick * self._interval
        self._tick += 1
        return ColumnMeasurement(
            readings.step(sensors, 0, true[0], error[0], t), readings.step(sensors, 1, true[1], error[1], t)
        )

    def write(self, command: ColumnCommand) -> None:
        """Move on by one interval, ramping to the command."""
        self._true = self._advance(self._lab, command.actuator_command)

    def disarm(self) -> None:
        """An emulated actuator stays where it is."""
