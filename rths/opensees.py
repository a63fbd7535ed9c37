"""A column whose specimen is a material or a model of OpenSees: `class = "rths.opensees:Specimen"` in a rig's table.

The actuator is the one that ships, emulated; what it reaches is imposed on OpenSees, in a process of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from common.errors import InputError
from common.opensees.process import SpecimenProcess, absolute
from laboratories.column.under_actuator import WHERE, Array, UnderActuator

SUBSTEPS = 4  # deformations of an interval through which a specimen is led


class Specimen(UnderActuator):
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
        super().__init__(interval, seed, self._forced, actuator, sensors, substeps)
        self._process = SpecimenProcess(*task(materials, file, options or {}))

    def _forced(self, way: Array) -> float:
        return self._process.force(way)

    def arm(self) -> None:
        """Refuse a specimen whose process has ended."""
        self._process.force([0.0])

    def disarm(self) -> None:
        """The actuator stays where it is, and OpenSees ends."""
        self._process.close()


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
