"""The emulated actuator above a specimen whose force comes from elsewhere: another program, another model."""

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

WHERE = "options of a rig"  # in sentences about tables that the options hold


class UnderActuator:
    """Actuator and sensors; `force` gives the force (N) at the end of a way (m) of `substeps` deformations.

    `actuator` and `sensors` are as the plan has these tables; the actuator does not feel the force.

    Raises:
        InputError: a table cannot be, or the actuator is one that feels the force.
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
        """Readings at the present tick, with the sensors' noise."""
        return ColumnMeasurement(*map(add, self._true, self._noise.row()))

    def write(self, command: ColumnCommand) -> None:
        """Move on by one interval: the specimen follows the actuator in straight lines."""
        reached, _ = self._move(command[0])
        way = np.linspace(self._true[0], reached, self._substeps + 1)[1:]
        self._true = (reached, self._force(way))
