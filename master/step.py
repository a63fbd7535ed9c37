"""The master's computation of one tick, from measurements to commands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from common.plan.plan import Plan
from loop import substructure
from models.compiled import plain
from models.registry import Array

Values = float | list[float]
Sent = tuple[float, ...]  # target m, motor force N, and the rates of the target m/s, m/s², m/s³


class Outputs(NamedTuple):
    """What a tick computes: the building and the targets at t_k, and the commands for the interval's end.

    What concerns storeys is one value each where there are several. Of a master without a laboratory target, command
    and effort are zero.
    """

    ground_acceleration: float
    target: float  # of its own laboratory at t_k, m
    command: float  # of its transfer system, m
    effort: float  # of its motor, N
    sent: list[Sent]  # to each slave, in the plan's order
    displacement: Values
    velocity: Values
    acceleration: Values
    absolute_acceleration: Values
    numerical_force: Values


class MasterStep:
    """The numerical substructure with the control of every laboratory, moving on tick by tick."""

    def __init__(self, plan: Plan, ground: Array, p_delta: float = 0.0) -> None:
        building = substructure.build(plan, ground, p_delta)
        self._building, self._output = plain(building), building.output
        self._forces = substructure.forces(building)
        width, first = substructure.SENT_VALUES, substructure.OF_SLAVES
        end = first + width * len(plan.roles)
        self._sent = [slice(place, place + width) for place in range(first, end, width)]
        n = plan.storeys
        self._end = end
        self._storeys = [slice(place, place + n) for place in range(end, building.output.size, n)]
        self._one_storey = n == 1
        self._advance = substructure.enter

    def __call__(self, tick: int, position: float, force: float, forces: Sequence[float]) -> Outputs:
        """One tick, from the master's own position (m) and force (N) as measured and each slave's force (N)."""
        for place, used in enumerate(forces):
            self._forces[place] = used
        self._advance(self._building, tick, position, force)
        row = self._output.tolist()
        sent = [tuple(row[place]) for place in self._sent]
        ground, target, command, effort = row[: substructure.OF_SLAVES]
        storeys = row[self._end :] if self._one_storey else [row[place] for place in self._storeys]
        return Outputs(ground, target, command, effort, sent, *storeys)
