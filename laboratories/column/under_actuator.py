"""The emulated actuator on a specimen whose force another program or model computes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from operator import add
from typing import Any

import numpy as np

from common.errors import InputError
from common.plan.laboratory_tables import Actuator
from common.plan.plan import Plan
from common.plan.schema import fill
from common.plan.tables import SensorsTable, Test
from common.rig import ColumnCommand, ColumnMeasurement
from laboratories.column.kind import COLUMN
from laboratories.sensors import noise
from models.registry import Array
from models.system import System

__all__ = ["Array", "UnderActuator"]

WHERE = "options of a rig"  # name of the tables within the options, for messages


class UnderActuator:
    """Actuator and sensors; `force` returns the force (N) at the end of a path (substeps,) of deformations (m).

    `actuator` and `sensors` are tables as in a plan; the force does not act on the actuator.

    Raises:
        InputError: a table is not valid, or the actuator's model depends on the force.
    """

    def __init__(
        self,
        interval: float,
        seed: int,
        force: Callable[[Array], float],
        actuator: Mapping[str, Any] | None,
        sensors: Mapping[str, Any] | None,
        substeps: int,
    ) -> None:
        plan = Plan(
            test=Test(interval=interval),
            actuator=fill(Actuator, actuator or {}, f"{WHERE}: actuator"),
            sensors=fill(SensorsTable, sensors or {}, f"{WHERE}: sensors"),
        )
        if plan.actuator.model != "fopdt":
            raise InputError(
                f"model in [{WHERE}: actuator] is '{plan.actuator.model}', but an actuator above a specimen of another "
                "program must be 'fopdt': it does not feel the force."
            )
        if substeps < 1:
            raise InputError(f"substeps in [{WHERE}] is {substeps}, but must be at least 1.")
        self._move, self._substeps, self._force = COLUMN.mover(COLUMN.build(System(plan))), substeps, force
        self._noise = noise.Noise(seed, COLUMN.noise(plan))
        self._true = (0.0, 0.0)

    def read(self) -> ColumnMeasurement:
        """The measurements at the present tick, with the noise of the sensors."""
        return ColumnMeasurement(*map(add, self._true, self._noise.row()))

    def write(self, command: ColumnCommand) -> None:
        """Advance by one interval, in which the deformation changes linearly."""
        reached, _ = self._move(command[0])
        way = np.linspace(self._true[0], reached, self._substeps + 1)[1:]
        self._true = (reached, self._force(way))
