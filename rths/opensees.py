"""A column whose specimen is a material or a model of OpenSees: `class = "rths.opensees:Specimen"` in a rig's table.

The actuator is the one that ships, emulated; what it reaches is imposed on OpenSees, in a process of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import add
from typing import Any

import numpy as np

from common.errors import InputError
from common.opensees.process import SpecimenProcess, absolute
from common.plan.laboratory_tables import Actuator, Column
from common.plan.plan import Plan
from common.plan.schema import fill
from common.plan.tables import SensorsTable, Test
from common.rig import ColumnCommand, ColumnMeasurement
from laboratories.column.kind import COLUMN
from laboratories.sensors import noise
from models.compiled import plain
from models.system import System

WHERE = "options of a rig"  # in sentences about tables that the options hold
SUBSTEPS = 4  # deformations of an interval through which a specimen is led


class Specimen:
    """Laboratory A or a column at a slave: an actuator, and a specimen of OpenSees under it.

    Either `materials` are given, rows as `uniaxialMaterial` takes them, of which the last is the specimen, with
    deformation (m) as strain and force (N) as stress; or a `file` with a function `build(ops, **options)` that makes a
    model and gives node and direction (from 1) that are moved. `actuator` and `sensors` are the laboratory's own, as
    the plan has these tables; the actuator does not feel the force.

    Raises:
        InputError: the options do not fit together, OpenSees is not installed, or it refuses what they say.
    """

    def __init__(
        self,
        interval: float,
        seed: int,
        materials: Sequence[Sequence[Any]] = (),
        file: str = "",
        options: Mapping[str, Any] | None = None,
        actuator: Mapping[str, Any] | None = None,
        sensors: Mapping[str, Any] | None = None,
        substeps: int = SUBSTEPS,
    ) -> None:
        plan = Plan(
            test=Test(interval=interval),
            actuator=fill(Actuator, actuator or {}, f"{WHERE}: actuator"),
            sensors=fill(SensorsTable, sensors or {}, f"{WHERE}: sensors"),
            column=Column(),
        )
        if plan.actuator.model != "fopdt":
            raise InputError(
                f"model in [{WHERE}: actuator] is '{plan.actuator.model}', but an actuator before a specimen of "
                "OpenSees must be 'fopdt': it does not feel the force."
            )
        if substeps < 1:
            raise InputError(f"substeps in [{WHERE}] is {substeps}, but must be at least 1.")
        self._lab, self._substeps = plain(COLUMN.build(System(plan))), substeps
        self._noise = noise.Noise(seed, COLUMN.noise(plan))
        self._true = (0.0, 0.0)
        self._tester = SpecimenProcess(*task(materials, file, options or {}))

    def arm(self) -> None:
        """Refuse a specimen whose process has ended."""
        self._tester.force([0.0])

    def read(self) -> ColumnMeasurement:
        """Readings at the present tick, with the sensors' noise."""
        return ColumnMeasurement(*map(add, self._true, self._noise.row()))

    def write(self, command: ColumnCommand) -> None:
        """Move on by one interval: the specimen follows the actuator in straight lines."""
        reached, _ = COLUMN.enter(self._lab, command[0])
        way = np.linspace(self._true[0], reached, self._substeps + 1)[1:]
        self._true = (reached, self._tester.force(way))

    def disarm(self) -> None:
        """The actuator stays where it is, and OpenSees ends."""
        self._tester.close()


def task(
    materials: Sequence[Sequence[Any]], file: str, options: Mapping[str, Any]
) -> tuple[str, dict[str, Any]]:
    """The name of a specimen and what its process is told; raises InputError where it is none, or two."""
    if bool(materials) == bool(file):
        raise InputError(f"[{WHERE}] needs either materials or a file with a model of OpenSees.")
    if file:
        return f"'{file}'", {"model": absolute(file), "options": dict(options)}
    for row in materials:
        if (
            not isinstance(row, Sequence)
            or isinstance(row, str)
            or len(row) < 2
            or not isinstance(row[1], int)
        ):
            raise InputError(
                f'materials in [{WHERE}] has the row {row!r}, but each must be ["NAME", tag, …] as uniaxialMaterial '
                "takes it."
            )
    return f"'{materials[-1][0]}'", {"materials": [list(row) for row in materials]}
