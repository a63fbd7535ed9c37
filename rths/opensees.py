"""A column whose specimen is a material or a model of OpenSees: `class = "rths.opensees:Specimen"` in a rig's table.

The actuator is the emulated one of this program. The displacement that it reaches is imposed on OpenSees, which runs in
a process of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from common.errors import InputError
from common.opensees.process import SpecimenProcess, absolute
from laboratories.column.under_actuator import WHERE, Array, UnderActuator

# Deformations per interval that are imposed one after the other: at 2 ms those are the 0.5 ms in which an actuator
# with a time constant of 30 ms moves almost in a straight line.
SUBSTEPS = 4


class Specimen(UnderActuator):
    """Laboratory A or a column at a slave: an actuator, and a specimen of OpenSees under it.

    Either `materials` or `file` is given. `materials` are rows as `uniaxialMaterial` takes them; the last one is the
    specimen, with its deformation (m) as strain and its force (N) as stress. `file` has a function
    `build(ops, **options)`, which makes a model and returns the node and the direction (from 1) to be moved.
    `actuator` and `sensors` are the laboratory's own tables, with the keys of the plan's. The force does not act back
    on the actuator.

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
        """Raise RigError if the process of the specimen has ended."""
        self._process.force([0.0])

    def disarm(self) -> None:
        """Leave the actuator where it is, and end OpenSees."""
        self._process.close()


def task(
    materials: Sequence[Sequence[Any]], file: str, options: Mapping[str, Any]
) -> tuple[str, dict[str, Any]]:
    """The name of a specimen and the description for its process.

    Raises:
        InputError: both or none of `materials` and `file` are given, or a row is no material.
    """
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
