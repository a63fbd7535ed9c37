"""The master's computation of one tick, from measurements to commands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from common.plan.plan import Plan
from loop import substructure
from models.compiled import plain
from models.registry import Array

Values = float | list[float]
Sent = tuple[float, float, float, float, float]


class Outputs(NamedTuple):
    """What a tick computes: the building at t_k, and the commands for the interval's end.

    What goes to the slaves is one value each where there are several, what concerns storeys likewise.
    """

    ground_acceleration: float
    column_target: float  # of t_k
    actuator_command: float
    table_target: Values
    damper_command: Values
    table_target_velocity: Values
    table_target_acceleration: Values
    table_target_jerk: Values
    displacement: Values
    velocity: Values
    acceleration: Values
    absolute_acceleration: Values
    numerical_force: Values

    def sent(self) -> list[Sent]:
        """The command for each slave in its message's order: the target, the motor's force, the target's rates."""
        values: Any = (
            self.table_target,
            self.damper_command,
            self.table_target_velocity,
            self.table_target_acceleration,
            self.table_target_jerk,
        )
        return [values] if type(self.table_target) is float else list(zip(*values, strict=True))


class MasterStep:
    """The numerical substructure, the compensator and the dampers' control, moving on tick by tick."""

    def __init__(self, plan: Plan, ground: Array, p_delta: float = 0.0) -> None:
        building = substructure.build(plan, ground, p_delta)
        self._building, self._output = plain(building), building.output
        self._forces = building.dampers[substructure.FORCE_USED]
        self._plain = plan.storeys == len(plan.roles) == 1
        self._places = list(substructure.layout(len(plan.roles), plan.storeys).values())
        self._advance = substructure.enter

    def __call__(
        self, tick: int, column_displacement: float, column_force: float, damper_forces: Sequence[float]
    ) -> Outputs:
        """One tick; displacement m, forces N, all as measured, each slave's damper force at its own scale."""
        for place, force in enumerate(damper_forces):
            self._forces[place] = force
        self._advance(self._building, tick, column_displacement, column_force)
        row = self._output.tolist()
        return Outputs(*row) if self._plain else self._grouped(row)

    def _grouped(self, row: list[float]) -> Outputs:
        """The values of a row by name, those of several slaves or storeys together."""
        groups = (row[place] for place in self._places)
        return Outputs(*(values if len(values) > 1 else values[0] for values in groups))  # type: ignore[arg-type]
