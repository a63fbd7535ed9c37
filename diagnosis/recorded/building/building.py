"""The numerical substructure of a recording as a part of the test."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from common.recording.imported import ImportedData
from common.roles import MASTER
from diagnosis.recorded.building import motion
from diagnosis.recorded.building.motion import GROUND, MOTION
from diagnosis.recorded.nuisances import LATE, of_building
from diagnosis.recorded.parts import Measured, of_sites
from diagnosis.recorded.record import Record
from laboratories.kinds import kind_of
from loop import replay
from models.registry import Array
from models.system import System


class Building(Measured):
    """The numerical substructure from the ground motion and the forces that the master used.

    It is exact where the recorded forces are the very numbers that the master used; otherwise a logger recorded them.
    """

    name = "structure"
    role = MASTER
    exact = True

    def __init__(self, record: Record) -> None:
        plan, none = record.plans[MASTER], np.zeros(record.ticks)
        own, other = record.own, record.other
        if record.whole is not None:
            used = record.whole.used
            came = [kind_of(plan, role).channels.used for role in plan.roles]
        elif other is not None:
            used, came = record.signals[other.kind.channels.used][:, None], [other.kind.channels.used]
        else:
            used, came = np.zeros((record.ticks, 0)), []
        names = (own.kind.channels.position, own.kind.channels.force) if own else ()
        read = [record.signals[name] for name in names] or [none, none]
        self._inputs = (read[0], read[1], used)
        self._force = own.kind.channels.force if own else ""
        self.sources = (self._force, *came) if own else ()  # forces used, the own laboratory's first
        self._noise = record.planned_noise.get(self._force, 0.0)  # N, of the own laboratory's force
        self.linear = plan.structure.columns.model == "linear"
        self._plan, self.whole = plan, record.has(*MOTION)
        self._scale = own.kind.coupling(own.plan).scale if own else 1.0
        self._interval = record.plan.test.interval
        self._recorded = tuple(name for name in MOTION if record.has(name))
        self._ground = np.zeros((2, record.ticks + 1))
        self._ground[0, :-1] = motion.of_ground(record)
        storeys = plan.storeys
        self.signals = tuple(name for name in self._recorded for _ in range(storeys))
        rows = {name: record.signals[name].reshape(record.ticks, -1) for name in self._recorded}
        self.measured = np.hstack([*rows.values()])
        self.present = np.repeat(record.present["displacement"][:, None], self.measured.shape[1], axis=1)
        self.motion = np.hstack([*motion.of_storeys(record, rows).values()])
        stated = record.stated or ImportedData("")
        known = [name if name in rows else "displacement" for name in MOTION for _ in range(storeys)]
        seen = (*known, GROUND, self._force, *came)  # motion, ground and forces
        self.channels = tuple(stated.channel(MASTER, name) for name in seen)
        self._stated = stated.channel(MASTER, self._force)
        # s, standard deviation of the delay of a logger of forces
        self.usual = max(LATE, record.late.force.about)
        self.nuisances = of_building(plan)
        self.candidates = of_sites(record, ("structure",), plan)

    def predict(self, system: System) -> Array:
        """What was recorded of displacement, velocity and acceleration of every storey."""
        return self.computed(system, self._recorded)

    def computed(self, system: System, names: Sequence[str] = MOTION) -> Array:
        """These of displacement, velocity and acceleration, (ticks, names · storeys)."""
        rows = replay.building(system, self._ground, *self.forces(system))
        return np.column_stack([rows[name] for name in names])

    @property
    def treated(self) -> bool:
        """Whether filters, means or delays of a logger differ between its motion, the ground's and the forces."""
        return len({(one.filter, one.average, one.means, one.delay) for one in self.channels}) > 1

    @property
    def ground(self) -> Array:
        """Ground acceleration (ticks,)."""
        return self._ground[0, :-1]

    def forces(self, system: System) -> tuple[Array, Array, Array]:
        """Position and force of the master's laboratory and the forces of the others, as the master used them."""
        return self._inputs

    def first(self, ticks: int) -> Building:
        """The whole of it, because it is computed and cheap."""
        return self
