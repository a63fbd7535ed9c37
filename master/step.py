"""The master's computation of one tick, from measurements to commands."""

from __future__ import annotations

from typing import NamedTuple

from common.plan import Plan
from models import substructure
from models.registry import Array

Storeys = float | list[float]


class Outputs(NamedTuple):
    """What a tick computes: the building at t_k, and the commands for the interval's end."""

    ground_acceleration: float
    column_target: float  # of t_k
    actuator_command: float
    table_target: float
    damper_command: float
    table_target_velocity: float
    table_target_acceleration: float
    table_target_jerk: float
    displacement: Storeys
    velocity: Storeys
    acceleration: Storeys
    absolute_acceleration: Storeys
    numerical_force: Storeys

    def sent(self) -> tuple[float, float, float, float, float]:
        """The command for laboratory B in its message's order: the target, the motor's force, the target's rates."""
        return self[3:8]


class MasterStep:
    """The numerical substructure, the compensator and the damper's control, moving on tick by tick."""

    def __init__(self, plan: Plan, ground: Array, p_delta: float = 0.0) -> None:
        self._arrays = substructure.build(plan, ground, p_delta)
        self._storeys = plan.storeys
        self._advance = substructure.advance

    def __call__(
        self, tick: int, column_displacement: float, column_force: float, damper_force: float
    ) -> Outputs:
        """One tick; displacement m, forces N, all as measured, the damper's at its own scale."""
        arrays = self._arrays
        self._advance(*arrays, tick, column_displacement, column_force, damper_force)
        row = arrays.output.tolist()
        n = self._storeys
        if n == 1:
            return Outputs(*row)
        first = substructure.STOREYS
        groups = [
            row[first + place * n : first + (place + 1) * n] for place in range(len(substructure.STOREY_ROWS))
        ]
        return Outputs(*row[:first], *groups)
