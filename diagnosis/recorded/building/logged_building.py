"""The numerical substructure of a recording whose forces came through a data logger."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping

import numpy as np
from scipy import ndimage

from diagnosis.recorded.building.building import Building
from diagnosis.recorded.nuisances import ALIKE, CALIBRATED, UNLIKE, LoggedForce
from diagnosis.recorded.record import LEAST_TICKS, Delay
from diagnosis.signals import alike, low_pass
from diagnosis.signals.earlier import earlier
from diagnosis.signals.mask import longest
from diagnosis.signals.strength import BEYOND
from loop.nominal import partition
from models.registry import Array
from models.structures import shear_building
from models.system import System

BALANCE = "force_balance"  # signal of a building that is judged by the balance of its forces, N
PER_PERIOD = 12  # averages in the shortest period, of which noise is told from the motion
FEWEST = 50  # of averages at least, by which noise is known
SMOOTHED = (
    0.125  # of the shortest period, by which motions are averaged that tell what noise of forces is not
)
STEADY = 0.3  # of the noise of a force, by which its zero may be off and drift to either side, unseen
BEFORE = 0.75  # share of what stated filters change, from which on they lie before the master
SURE = 3.0  # standard deviations from which on a stated filter is taken to lie before the master
OF_DIFFERENCES = 70.0  # Σ of the squared weights of fourth differences
HALF = 0.5  # of the highest frequency of ticks, up to which noise is as loud as below it
SLOPES = 2  # ticks to either side that the slopes and bends of a displacement take in


def logged(building: Building) -> LoggedBuilding:
    """The same building, of which the forces used are known up to a logger's noise.

    What was recorded lies behind the filters and delays that are stated for it, unless these lie before the master too,
    so that what was recorded is what it used.
    """
    plain = LoggedBuilding(building)
    if not (building.linear and building.treated):
        return plain
    behind = LoggedBuilding(building, behind=True)
    rows = slice(None, None, plain.row)
    return plain if before_master(plain.left()[rows], behind.left()[rows]) else behind


def before_master(plain: Array, behind: Array) -> bool:
    """Whether stated filters lie before the master, from what is left (rows, storeys) without and with them.

    If so, the second is the first, plus what the filters change, which is known; else it has nothing of that change, or
    half of it, where a delay brings the noise of the motion at another time in its place. Fourth differences keep what
    no parameter of a building makes; of every fifth, white noise is independent.
    """
    change, left = (np.diff(x, n=4, axis=0)[::5].ravel() for x in (behind - plain, behind))
    energy = float(change @ change)
    part = float(left @ change)
    return part > max(BEFORE * energy, SURE * math.sqrt(energy * float(np.mean(np.square(left)))))


def white_noise(values: Array) -> float:
    """Mean square of what is white in values (ticks, storeys), by fourth differences, over all storeys."""
    apart = 1.4826 * np.median(np.abs(np.diff(values, n=4, axis=0)), axis=0)
    return float(np.sum(np.square(apart))) / OF_DIFFERENCES


def summed(values: Array, size: int) -> Array:
    """Sums of so many rows (rows, storeys) each, over the root of their number: those of white noise have its level."""
    rows = len(values) // size
    return np.asarray(values[: rows * size].reshape(rows, size, -1).sum(axis=1) / math.sqrt(size))


def within_tolerances(left: Array, slopes: Array, usual: float) -> Array:
    """What of `left` (n,) parameters make up for, of which `slopes` (n, parameters) are those over tolerances.

    Beside noise of a `usual` rms each errs by one tolerance. A building of any mass would leave less of the noise.
    """
    known = np.vstack([slopes, usual * np.eye(slopes.shape[1])])
    z = np.linalg.lstsq(known, np.append(left, np.zeros(slopes.shape[1])))[0]
    return np.asarray(slopes @ z)


class LoggedBuilding(Building):
    """The numerical substructure whose forces came through a logger, by the balance of its forces.

    The motion is the master's own number, so what the equation of motion says of it differs from the forces recorded by
    noise of their readings alone, sample by sample. In the displacement that noise would have gone through
    the building, and would look like a motion. The logger's delay and gain join the nominal parameters; what it does to
    one force it mostly does to all.

    Where what was recorded lies `behind` stated filters and delays, motion, ground and every force also pass those of
    the others: the balance of a linear building holds behind a filter as it does before it, and no filter is undone.
    A delay beyond those stated is then one of the forces that the logger filtered: others are the master's own numbers.
    So are they where the balance is far likelier if the own laboratory's force `alone` came through the logger.

    The master read its forces with noise, which the motion has, and the log may have noise of its own in their place. A
    building of a smaller mass would have less of the noise of the motion.
    """

    exact = False

    def __init__(self, of: Building, *, behind: bool = False) -> None:
        self.__dict__.update(of.__dict__)
        self.behind = behind
        if behind:
            self.pass_alike()
        plan = self._plan
        self.signals = (BALANCE,) * plan.storeys
        self.measured = self.balance(System(plan), self.motion)
        there = of.present[:, : plan.storeys]
        self.present = ndimage.binary_erosion(there, np.ones((2 * SLOPES + 1, 1)), border_value=1)
        self.about = 0.0 if of.linear else self._stated.late
        late = ALIKE if behind else max(ALIKE, UNLIKE * self.about) if self.about else of.usual
        zero = STEADY * self._noise
        rows = (
            ("delay", late, self.about),
            ("gain", self._stated.calibration or CALIBRATED, 0.0),
            ("bias", zero, 0.0),
            ("drift", 2.0 * zero / (len(of.motion) * self._interval), 0.0),
        )
        logger = tuple(
            LoggedForce(name, by, None, self._force, at) for name, by, at in rows if self._force and by > 0.0
        )
        self.nuisances = (*of.nuisances, *logger)
        self.alone, self.of_motion = False, 0.0
        whole = bool(of.present.all()) and len(self.measured) >= LEAST_TICKS
        if of.linear and not behind and whole and len(self.sources) > 1:
            self.alone = self.delayed_alone()
        stretch = longest(np.all(self.present, axis=1))
        if stretch.stop - stretch.start >= LEAST_TICKS:
            self.of_motion = self.noise_of_motion(stretch)

    def noise_of_motion(self, stretch: slice) -> float:
        """The share of what the balance leaves that is noise of the motion.

        A stretch without missing rows tells it. It is that of averages over a twelfth of the shortest period, less what
        nominal parameters make up for. Noise of the log may have any colour, while that of the motion is taken for
        white. Noise that the log has as well leaves nothing, by what is left of it at the highest frequencies.
        """
        ticks = stretch.stop - stretch.start
        size = max(1, min(round(self.shortest / (PER_PERIOD * self._interval)), ticks // FEWEST))
        system = System(self._plan)
        systems = [system, *(one.moved(system, 1.0) for one in self.nuisances)]
        sums = np.stack([summed(self.left(one)[stretch], size) for one in systems])
        rest, *others = sums.reshape(len(systems), -1)
        if others:
            usual = math.sqrt(white_noise(sums[0]) / sums.shape[2])
            rest = rest - within_tolerances(rest, np.stack(others, axis=1) - rest[:, None], usual)
        level = float(np.mean(np.square(rest))) * sums.shape[2]
        fastest = max(1, math.ceil(0.5 / (self._interval * self.cutoff)))
        rest, motion = (
            np.diff(summed(x[stretch], fastest), n=4, axis=0)[::5] for x in (self.left(), self.measured)
        )
        shared = float(np.sum(np.mean(rest * motion, axis=0))) / OF_DIFFERENCES
        return float(np.clip(shared / level, 0.0, 1.0)) if level > 0.0 else 0.0

    def delayed_alone(self) -> bool:
        """Whether what was recorded of the other forces is what the master used, and only the own one is delayed."""
        own, every = (self.demanded(used=used) for used in (False, True))
        if low_pass.likelier_whole(every, own) >= BEYOND:
            return False
        alone, together = (low_pass.roughly(one) for one in (own, every))
        return alone.gain > BEYOND and alone.surprise < together.surprise - BEYOND

    def demanded(self, *, used: bool) -> low_pass.ReadSpectra:
        """Spectra of the forces recorded and of those that the motion demands; as `forces_demanded` has them."""
        rows = self.forces_demanded(used=used)
        return low_pass.spectra(*rows, self._interval, 0.5 / self._interval, noisy=True)

    def pass_alike(self) -> None:
        """Bring motion, ground and forces behind the same filters, each as late as the own laboratory's force."""
        position, force, used = self._inputs
        rows = np.column_stack([self.motion, self.ground, force, used])
        rows = alike.alike(rows, self.channels, self._stated.delay, self._interval)
        storeys = self.motion.shape[1]
        self.motion, self._ground = rows[:, :storeys], self._ground.copy()
        self._ground[0, :-1] = rows[:, storeys]
        self._inputs = position, rows[:, storeys + 1], rows[:, storeys + 2 :]

    def left(self, system: System | None = None) -> Array:
        """What a building leaves of the balance, the nominal one where none is given, (ticks, storeys) N."""
        return self.measured - self.predict(system or System(self._plan))

    def forces_demanded(self, *, used: bool) -> tuple[Array, Array, Array]:
        """What recorded forces are in the balance, and what the building's motion demands of them, (ticks, 1) N.

        That is the own laboratory's force, or with `used` those of the others too, at the storey where they are
        largest. The third are slopes of what is demanded over the building's parameters, (ticks, 1, parameters).
        """
        position, force, others = self._inputs
        less = copy.copy(self)
        less._inputs = position, 0.0 * force, 0.0 * others if used else others
        system = System(self._plan)
        left = self.left(system)
        forces = left - less.left(system)
        storey = [int(np.argmax(np.sum(np.square(forces), axis=0)))]
        own = [one for one in self.nuisances if not one.of_record]
        slopes = [left[:, storey] - self.left(one.moved(system, 1.0))[:, storey] for one in own]
        demanded = (forces - left)[:, storey]
        return forces[:, storey], demanded, np.stack([*slopes, CALIBRATED * demanded], axis=2)

    @property
    def passes(self) -> Array:
        """Frequencies (storeys,) up to which noise is as loud as at low ones, Hz.

        The highest frequencies of ticks hold less where a converter or a spline through rows took some of it.
        """
        return np.full(len(self.signals), min(self.cutoff, HALF / (2.0 * self._interval)))

    @property
    def cutoff(self) -> float:
        """Frequency up to which filters passed noise, Hz: those of forces, all of them where these are alike.

        A motion whose numbers were logged more slowly than at every tick has none beyond half their rate.
        """
        motion = self.channels[: self.motion.shape[1]]
        return min(one.passes for one in (self.channels if self.behind else (self._stated, *motion)))

    @property
    def row(self) -> int:
        """Ticks from one row of the motion to the next."""
        rate = self.channels[0].rate if self.channels[0].interpolated else 0.0
        return max(1, round(1.0 / (rate * self._interval))) if rate > 0.0 else 1

    @property
    def shortest(self) -> float:
        """The shortest natural period of the planned building, s."""
        return float(np.min(shear_building.modes(*partition.matrices(self._plan)).periods))

    @property
    def smooth(self) -> Array:
        """The motion without most of the noise of the forces that the controller read, shape as `motion`."""
        return self.smoothed(self.motion)

    @property
    def read(self) -> Array:
        """What noise of the balance may grow with, without most of that noise, (ticks, storeys).

        It is the force of the master's laboratory, N; where there is none the displacements, m, whose digits a log
        prints to a share of them.
        """
        storeys = len(self.signals)
        if self._force:
            return np.repeat(self.smoothed(self._inputs[1])[:, None], storeys, axis=1)
        return self.smooth[:, :storeys]

    def smoothed(self, values: Array) -> Array:
        """Means of values (ticks, …) with normal weights: 6 % of a wave of a third of the shortest period is left."""
        width = SMOOTHED * self.shortest / self._interval
        return np.asarray(ndimage.gaussian_filter1d(values, width, axis=0))

    def balance(self, system: System, motion: Array) -> Array:
        """M·ẍ + C·ẋ + K·x of the numerical part, (ticks, storeys) N, for displacement, velocity and acceleration."""
        M, C, K = partition.numerical(system.plan)
        gravity = shear_building.tridiagonal(np.full(len(M), system.effects.p_delta))
        x, v, a = np.split(motion, 3, axis=1)
        return np.asarray(a @ M.T + v @ C.T + x @ (K + gravity).T)

    def predict(self, system: System) -> Array:
        """The balance of the nominal building, less the residual balance of the hypothesis.

        What it leaves is at the time of the reading, and over what changes its noise: a gain that of the motion and a
        mass as well, which the reading has not. So the parameters that leave least are those that explain most.
        """
        delay, gain = self.logger(system)
        apart = np.where(self.present, self.balance(system, self.motion - self.computed(system)), 0.0)
        masses = [float(np.trace(partition.numerical(plan)[0])) for plan in (system.plan, self._plan)]
        louder = gain * masses[0] / masses[1]
        over = math.sqrt(1.0 + self.of_motion * (louder**2 - 1.0))
        return self.measured - gain / over * earlier(apart, -delay / self._interval)

    def forces(self, system: System) -> tuple[Array, Array, Array]:
        """Position and force of the master's laboratory and the forces of the others, as the master used them."""
        position, force, used = self._inputs
        delay, gain = self.logger(system)
        if made := system.effects.sensors.get(self._force):
            force = force - made.bias - made.drift * self._interval * np.arange(force.size)
        rows = np.column_stack([force, used])
        late = [
            not self.behind or one.filter is not None or one.average > 0.0
            for one in self.channels[-rows.shape[1] :]
        ]
        if self.alone:
            late[1:] = [False] * len(late[1:])
        rows[:, late] = earlier(rows[:, late], delay / self._interval)
        return position, rows[:, 0] / gain, rows[:, 1:] / (1.0 if self.alone else gain)

    def logger(self, system: System) -> tuple[float, float]:
        """Delay (s) and gain of the logger in a hypothesis."""
        made = system.effects.sensors.get(self._force)
        return (made.logger_delay, made.gain) if made else (self.about, 1.0)

    def rounded(self, steps: Mapping[str, float]) -> dict[str, float]:
        """The step of the balance where the force is rounded to one of `steps`, by signal."""
        return {BALANCE: self._scale * steps[self._force]} if self._force in steps else {}

    def late(self, z: Array, sure: Array) -> Delay | None:
        """Delay of the logger that recorded the force; None without such a force.

        `z` and `sure` (nuisances,) are the values of a fit and their standard deviations, in tolerances.
        """
        for one, value, by in zip(self.nuisances, z, sure, strict=True):
            if isinstance(one, LoggedForce) and one.parameter == "delay":
                return Delay(max(0.0, one.about + float(value) * one.tolerance), float(by) * one.tolerance)
        return None
