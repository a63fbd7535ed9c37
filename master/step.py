"""The master's computation of a tick, from measurements to commands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from common.plan.plan import Plan
from common.signals import OF_STOREYS
from loop import substructure
from models.compiled import plain
from models.registry import Array

Sent = tuple[float, ...]  # target m, motor force N, and the rates of the target m/s, m/s², m/s³


class Outputs(NamedTuple):
    """The results of a tick: the building and the target at t_k, and the commands for the interval's end.

    For a master without a laboratory target, command and effort are zero.
    """

    ground_acceleration: float
    target: float  # of its own laboratory at t_k, m
    command: float  # of its transfer system, m
    effort: float  # of its motor, N
    sent: list[Sent]  # to each slave, in the plan's order
    storeys: list[float]  # signal by signal (`common.signals.OF_STOREYS`) the values of all storeys

    @property
    def of_storeys(self) -> dict[str, list[float]]:
        """The values of every storey by signal."""
        n = len(self.storeys) // len(OF_STOREYS)
        return {name: self.storeys[place * n : (place + 1) * n] for place, name in enumerate(OF_STOREYS)}


class MasterStep:
    """The numerical substructure with the control of every laboratory; each call computes a tick."""

    def __init__(self, plan: Plan, ground: Array, p_delta: float = 0.0) -> None:
        building = substructure.build(plan, ground, p_delta)
        self._building, self._output = plain(building), building.output
        self._forces = substructure.forces(building)
        width, first = substructure.SENT_VALUES, substructure.OF_SLAVES
        end = first + width * len(plan.roles)
        self._sent = [slice(place, place + width) for place in range(first, end, width)]
        self._end = end
        self._advance = substructure.enter

    def __call__(self, tick: int, position: float, force: float, forces: Sequence[float]) -> Outputs:
        """Compute a tick from position (m) and force (N) of the master's laboratory and the slaves' `forces` (N)."""
        for place, used in enumerate(forces):
            self._forces[place] = used
        self._advance(self._building, tick, position, force)
        row = self._output.tolist()
        sent = [tuple(row[place]) for place in self._sent]
        ground, target, command, effort = row[: substructure.OF_SLAVES]
        return Outputs(ground, target, command, effort, sent, row[self._end :])
