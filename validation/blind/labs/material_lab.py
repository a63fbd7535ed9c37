"""Laboratory A whose column is a material of OpenSees: the servo loop of `column_lab`, the force of another program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from common.errors import InputError
from common.opensees.process import SpecimenProcess
from common.plan import schema
from common.plan.laboratory_tables import Column
from common.plan.tables import SensorsTable as Levels
from common.rig import ColumnCommand, ColumnMeasurement
from validation.blind.labs import materials
from validation.blind.labs.column_lab import SIGNALS, TrueColumnLab
from validation.blind.labs.sensors import TrueSensors, true_values

SUBSTEPS = 4  # deformations of a material in an interval, so that the event points of its law are met closely


class MaterialLab:
    """Servo loop, and a material of OpenSees in the column's place; an effect names it as `opensees.NAME`.

    Without an effect the column is elastic. The force does not act back on the servo.
    """

    def __init__(
        self,
        interval: float,
        seed: int,
        actuator: Mapping[str, Any] | None = None,
        column: Mapping[str, Any] | None = None,
        sensors: Mapping[str, Any] | None = None,
        effects: Sequence[Mapping[str, Any]] = (),
    ) -> None:
        levels = schema.plain(schema.fill(Levels, sensors or {}, "sensors"))
        self._servo = TrueColumnLab(interval, seed, actuator, column, dict.fromkeys(levels, 0.0))
        self._sensors = TrueSensors(SIGNALS, true_values(SIGNALS, levels), interval, seed)
        self._stiffness = schema.fill(Column, column or {}, "column").stiffness
        self._material = material(*chosen(effects), self._stiffness) if effects else None
        self._true = (0.0, 0.0)

    def arm(self) -> None:
        """An emulated laboratory is always ready."""

    def read(self) -> ColumnMeasurement:
        """Readings at the present tick."""
        return ColumnMeasurement(*self._sensors.read(self._true))

    def write(self, command: ColumnCommand) -> None:
        """Move on by one interval, ramping to the command; the deformation of the material is linear in between."""
        self._servo.write(command)
        place, _ = self._servo.read()
        way = np.linspace(self._true[0], place, SUBSTEPS + 1)[1:]
        force = self._material.force(way) if self._material else self._stiffness * place
        self._true = (place, force)

    def disarm(self) -> None:
        """The actuator stays where it is."""
        if self._material:
            self._material.close()


def chosen(effects: Sequence[Mapping[str, Any]]) -> tuple[str, Mapping[str, float]]:
    """Name and values of the one material that the effects name."""
    if len(effects) != 1:
        raise InputError("This laboratory takes one effect, 'opensees.NAME'.")
    name = str(effects[0]["name"]).removeprefix("opensees.")
    if name not in materials.MATERIALS:
        raise InputError(f"Unknown material '{name}': {schema.nearest(name, materials.MATERIALS)}")
    return name, effects[0]["parameters"]


def material(name: str, values: Mapping[str, float], stiffness: float) -> SpecimenProcess:
    """A material of the trial for a stiffness (N/m), in a process of its own."""
    return SpecimenProcess(f"'{name}'", {"materials": materials.calls(name, stiffness, values)})
