"""Effects of no catalogue in the building that the master computes, and in the ground motion that it follows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from common.plan.plan import Plan
from common.reality.reality import Reality
from common.roles import MASTER
from laboratories.kind import Follows
from laboratories.kinds import kinds_of
from loop.realised import true_system
from master.assembly import true_ground
from master.building import Outputs
from master.step import MasterStep
from models.registry import Array
from validation.blind.labs.unlisted.effect import Unlisted

ECHO, TREMOR, CLIPPED = range(1, 4)
JOINTS, POUNDING, FATIGUE, CLADDING, PENDULUM = range(4, 9)

REST = 2e-3  # m/s, over which the friction of joints turns round
DEEP = 1e-3  # m, depth of pounding at which its force is stated
FAR = 5e-3  # m, drift at which cladding is stiffer by what is stated
SWING = 0.02  # damping ratio of what hangs in the building

EFFECTS = {
    "x.ground.echo": Unlisted(
        ECHO, "the ground motion comes once more, reflected", {"share": (3e-4, 0.1), "later": (0.05, 0.6)}
    ),
    "x.ground.tremor": Unlisted(
        TREMOR, "a machine shakes the ground", {"acceleration": (2e-3, 0.1), "frequency": (1.0, 15.0)}
    ),
    "x.ground.clipped": Unlisted(
        CLIPPED, "the record's amplifier was too small: its peaks are cut", {"share": (0.03, 0.5)}
    ),
    "x.structure.joints": Unlisted(JOINTS, "friction in the frame's joints", {"force": (60.0, 4000.0)}),
    "x.structure.pounding": Unlisted(
        POUNDING,
        "the neighbouring building is hit on one side (Hertz; Jankowski, EESD 34, 2005)",
        {"force": (300.0, 6e4), "gap": (1e-3, 5e-3)},
    ),
    "x.structure.fatigue": Unlisted(
        FATIGUE, "stiffness is lost with the way travelled", {"share": (4e-3, 0.1), "way": (0.1, 0.8)}
    ),
    "x.structure.cladding": Unlisted(CLADDING, "cladding stiffens with the drift", {"share": (3e-3, 0.12)}),
    "x.structure.pendulum": Unlisted(
        PENDULUM, "a lamp or tank swings on the floor", {"mass": (20.0, 5e3), "frequency": (0.8, 5.0)}
    ),
}


def shaken(rows: Array, code: float, sizes: Sequence[float], interval: float) -> Array:
    """Rows of the ground (m/s², m) with an effect; a clipped record keeps its displacement."""
    a, b = sizes
    t = np.arange(rows.shape[1]) * interval
    if code == ECHO:
        later = np.stack([np.interp(t - b, t, row, left=row[0]) for row in rows])
        return np.asarray(rows + a * later)
    if code == TREMOR:
        omega = 2.0 * math.pi * b
        wave = a * np.sin(omega * t)
        return np.asarray(rows + np.stack([wave, -wave / omega**2]))
    if code == CLIPPED:
        most = (1.0 - a) * float(np.max(np.abs(rows[0])))
        return np.stack([np.clip(rows[0], -most, most), rows[1]])
    return rows


class StrangeBuilding(MasterStep):
    """The master's computation with an effect of no catalogue, of which the storey of the master's own column bears it.

    What resists at a tick follows from the drift and its speed of the tick before, carried on by one interval.
    """

    def __init__(self, reality: Reality, effect: Unlisted, parameters: Mapping[str, float]) -> None:
        plan, system = reality.plan, true_system(reality)
        sizes = [*(parameters[name] for name in effect.ranges), 0.0][:2]
        rows = shaken(true_ground(system), effect.code, sizes, plan.test.interval)
        super().__init__(system.plan, rows, system.effects.p_delta)
        coupling = kinds_of(plan)[MASTER].coupling(plan)
        self._code, self._sizes, self._interval = effect.code, sizes, plan.test.interval
        self._storey, self._scale = coupling.place - 1, coupling.scale
        self._stiffness = coupling.stiffness
        self._drift, self._rate, self._shaking = 0.0, 0.0, 0.0
        self._kept = [0.0, 0.0]

    def __call__(self, tick: int, position: float, force: float, forces: Sequence[float]) -> Outputs:
        """As of the plan's own building, with what the effect adds to the force of the storey's column."""
        more = self._resisting(self._drift + self._interval * self._rate, self._rate)
        outputs = super().__call__(tick, position, force + more / self._scale, forces)
        motion = outputs.of_storeys
        self._drift, self._rate = (
            between_floors(motion[name], self._storey) for name in ("displacement", "velocity")
        )
        self._shaking = motion["absolute_acceleration"][self._storey]
        return outputs

    def _resisting(self, drift: float, rate: float) -> float:
        """Restoring force (N) that the effect adds at a drift (m) and its rate (m/s)."""
        (a, b), k, kept = self._sizes, self._stiffness, self._kept
        if self._code == JOINTS:
            return a * math.tanh(rate / REST)
        if self._code == POUNDING:
            return a * math.pow(max(drift - b, 0.0) / DEEP, 1.5)
        if self._code == FATIGUE:
            kept[0] += abs(rate) * self._interval
            return -a * k * drift * (1.0 - math.exp(-kept[0] / b))
        if self._code == CLADDING:
            return a * k * drift * (drift / FAR) ** 2
        if self._code == PENDULUM:
            omega = 2.0 * math.pi * b
            inner = omega * omega * kept[0] + 2.0 * SWING * omega * kept[1]
            kept[1] -= (inner + self._shaking) * self._interval
            kept[0] += kept[1] * self._interval
            return -a * inner
        return 0.0


def between_floors(values: Sequence[float], storey: int) -> float:
    """Difference of a value over a storey (from 0)."""
    return values[storey] - (values[storey - 1] if storey else 0.0)


def fits(plan: Plan) -> bool:
    """Whether the master of a plan computes a building whose storey its own laboratory follows."""
    if plan.served or plan.foreign or MASTER not in plan.kinds:
        return False
    return kinds_of(plan)[MASTER].coupling(plan).follows is Follows.DRIFT
