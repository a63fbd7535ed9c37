"""Laboratory A, emulated: actuator, column and their sensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from common import schema
from common.plan import Actuator, Column, Sensors
from common.rig import ColumnCommand, ColumnMeasurement
from models.labs import column_lab, noise


class ColumnLab:
    """The emulated laboratory; options are the plan's tables `actuator`, `column` and `sensors`."""

    def __init__(
        self,
        interval: float,
        seed: int,
        actuator: Mapping[str, Any] | None = None,
        column: Mapping[str, Any] | None = None,
        sensors: Mapping[str, Any] | None = None,
    ) -> None:
        self._arrays = column_lab.build(
            interval,
            schema.fill(Actuator, actuator or {}, "actuator"),
            schema.fill(Column, column or {}, "column"),
        )
        self._noise = noise.Noise(seed, noise.levels_a(schema.fill(Sensors, sensors or {}, "sensors")))
        self._true = (0.0, 0.0)
        self._advance = column_lab.advance

    def arm(self) -> None:
        """Nothing can hinder an emulated laboratory."""

    def read(self) -> ColumnMeasurement:
        """Readings at the present tick, with the sensors' noise."""
        error = self._noise.row()
        return ColumnMeasurement(self._true[0] + error[0], self._true[1] + error[1])

    def write(self, command: ColumnCommand) -> None:
        """Move on by one interval, ramping to the command."""
        self._true = self._advance(*self._arrays, command.actuator_command)

    def disarm(self) -> None:
        """An emulated actuator stays where it is."""
