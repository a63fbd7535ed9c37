"""The numerical substructure of a recording as a part of the test."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from common.recording.imported import ImportedData
from common.roles import MASTER
from diagnosis.recorded.nuisances import of_building
from diagnosis.recorded.parts import Measured, of_sites
from diagnosis.recorded.record import Record
from laboratories.kinds import kind_of
from loop import replay
from models.registry import Array
from models.system import System

MOTION = ("displacement", "velocity", "acceleration")
GROUND = "ground_acceleration"
# Rows in an interval, below which they pass over ticks that count. Of faster rows near the ticks the times hardly tell
# which ticks they showed, and nearly all were.
SLOWER = 0.9


def differences(displacement: Array, interval: float) -> dict[str, Array]:
    """Displacements (ticks, storeys), and velocities and accelerations by central differences.

    These are the explicit Newmark method's own; others differ from them by the share (ω·interval)²/12.
    """
    velocity = np.gradient(displacement, interval, axis=0)
    bends = np.diff(displacement, 2, axis=0) / interval**2
    return {
        "displacement": displacement,
        "velocity": velocity,
        "acceleration": np.pad(bends, ((1, 1), (0, 0)), mode="edge"),
    }


def ground_as_motion(record: Record) -> Array:
    """The recorded ground acceleration (ticks,), between the ticks that rows showed as the motion is there.

    An import follows the plan's ground motion between these, and has all other numbers of the master by a cubic spline.
    Equations of motion hold of what they all are by one.
    """
    values, interval = record.signals[GROUND], record.plan.test.interval
    channel = (record.stated or ImportedData("")).channel(MASTER, GROUND)
    if not channel.followed or channel.rate * interval >= SLOWER:
        return values
    seen = channel.seen(record.ticks, interval)
    return np.asarray(CubicSpline(seen, values[seen])(np.arange(record.ticks)))


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
        self._ground[0, :-1] = ground_as_motion(record)
        storeys = plan.storeys
        self.signals = tuple(name for name in self._recorded for _ in range(storeys))
        rows = {name: record.signals[name].reshape(record.ticks, -1) for name in self._recorded}
        self.measured = np.hstack([*rows.values()])
        self.present = np.repeat(record.present["displacement"][:, None], self.measured.shape[1], axis=1)
        by_differences = differences(rows["displacement"], self._interval)
        self.motion = np.hstack([rows.get(name, by_differences[name]) for name in MOTION])
        stated = record.stated or ImportedData("")
        known = [name if name in rows else "displacement" for name in MOTION for _ in range(storeys)]
        seen = (*known, GROUND, self._force, *came)  # motion, ground and forces
        self.channels = tuple(stated.channel(MASTER, name) for name in seen)
        self._stated = stated.channel(MASTER, self._force)
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
        return len({(one.filter, one.average, one.delay) for one in self.channels}) > 1

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
