"""The master's computation of a tick, from measurements to commands."""

from __future__ import annotations

from collections.abc import Sequence

from common.earthquake_time import EarthquakeTime
from common.named import maker
from common.plan.plan import Plan
from laboratories import standstill
from loop import assembly, substructure
from master.building import BuildingStep, Outputs, Sent
from master.passage import Passage, SteppedBuilding
from models import compensators
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
        self._apart = SteppedBuilding(
            plan.test.interval,
            bound(substructure.enter_building, building, 0, 0.0),
            bound(compensators.enter, building.compensator, *compensators.STILL, plan.test.interval),
            building.asked,
            self._forces,
            self._output,
        )
        ramp = standstill.ramp_ticks(plan)
        self.time = EarthquakeTime(ramp) if ramp else None
        self.unheld = standstill.UNLIMITED
        self._behind = 0  # ticks that holds have added
        self._passage: Passage | None = None

    def hold(self, tick: int) -> None:
        """Let the earthquake's time slow down to standstill from a tick on."""
        assert self.time is not None  # noqa: S101 - the caller asks before
        self.time.hold(tick)
        self._passage = Passage(self._apart, self.time, tick)

    @property
    def told(self) -> Sent:
        """The values for the master's own laboratory at the end of the interval; zeros where it has none."""
        return tuple(self._apart.asked.tolist())

    def __call__(self, tick: int, position: float, force: float, forces: Sequence[float]) -> Outputs:
        """Compute a tick from position (m) and force (N) of the master's laboratory and the slaves' `forces` (N)."""
        if self._passage is not None and self.time is not None:
            if not self.time.settle(tick):
                return self._passage(tick, position, force, forces)
            self._behind, self._passage = self.time.behind, None
        for place, used in enumerate(forces):
            self._forces[place] = used
        self._advance(tick - self._behind, position, force)
        row = tuple(self._output.tolist())
        sent = [row[place] for place in self._sent]
        return computed((*row[: substructure.OF_SLAVES], sent, row[self._end :], False, 1.0))
