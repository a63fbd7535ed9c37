"""The master's computation of a tick, from measurements to commands."""

from __future__ import annotations

from collections.abc import Sequence

from common.named import maker
from common.plan.plan import Plan
from loop import assembly, substructure
from master.building import BuildingStep, Outputs
from models.compiled import bound
from models.registry import Array

computed = maker(Outputs)


class MasterStep(BuildingStep):
    """The numerical substructure with the control of every laboratory; each call computes a tick."""

    def __init__(self, plan: Plan, ground: Array, p_delta: float = 0.0) -> None:
        building = assembly.build(plan, ground, p_delta)
        self._output = building.output
        self._forces = substructure.forces(building)
        width, first = substructure.SENT_VALUES, substructure.OF_SLAVES
        end = first + width * len(plan.roles)
        self._sent = [slice(place, place + width) for place in range(first, end, width)]
        self._end = end
        self._advance = bound(substructure.enter, building, 0, 0.0, 0.0)

    def __call__(self, tick: int, position: float, force: float, forces: Sequence[float]) -> Outputs:
        """Compute a tick from position (m) and force (N) of the master's laboratory and the slaves' `forces` (N)."""
        for place, used in enumerate(forces):
            self._forces[place] = used
        self._advance(tick, position, force)
        row = tuple(self._output.tolist())
        sent = [row[place] for place in self._sent]
        return computed((*row[: substructure.OF_SLAVES], sent, row[self._end :], False))
