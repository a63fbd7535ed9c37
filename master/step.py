"""The master's computation of one tick, from measurements to commands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from common.plan.plan import Plan
from common.signals import OF_STOREYS, SENT
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
        self._forces = building.dampers[substructure.FORCE_USED]
        self._plain = plan.storeys == len(plan.roles) == 1
        places = substructure.layout(len(plan.roles), plan.storeys)
        self._sent = [places[name] for name in SENT]
        self._storeys = [places[name] for name in OF_STOREYS]
        self._advance = substructure.enter

    def __call__(self, tick: int, position: float, force: float, forces: Sequence[float]) -> Outputs:
        """One tick, from the master's own position (m) and force (N) as measured and each slave's force (N)."""
        for place, used in enumerate(forces):
            self._forces[place] = used
        self._advance(self._building, tick, position, force)
        row = self._output.tolist()
        ground, target, command = row[: substructure.OF_SLAVES]
        if self._plain:
            return Outputs(ground, target, command, 0.0, [tuple(row[3:8])], *row[8:])
        sent = list(zip(*(row[place] for place in self._sent), strict=True))
        storeys = (row[place] for place in self._storeys)
        values = (of if len(of) > 1 else of[0] for of in storeys)
        return Outputs(ground, target, command, 0.0, sent, *values)
