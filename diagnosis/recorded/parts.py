"""The parts of a test, each of which is replayed from its own recorded inputs and judged by itself.

A part is driven by commands that are known exactly. As long as its model is right, its prediction differs from its
readings by the sensors' noise alone, and a gap in one part does not enter another one.
"""

from __future__ import annotations

import copy
from collections.abc import Collection
from typing import Any, Protocol

import numpy as np

from common.plan.kinds import COLUMN
from common.plan.plan import Plan
from common.recording.imported import ImportedData, at_rest
from diagnosis.recorded.commands import followed
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.logger.beside_commands import beside_commands
from diagnosis.recorded.logger.finer import Finer
from diagnosis.recorded.logger.through import through_logger
from diagnosis.recorded.logger.unseen import unseen
from diagnosis.recorded.nuisances import (
    BETWEEN,
    CALIBRATED,
    OWN_RATE,
    LoggedReadings,
    Nuisance,
    between_rows,
    calibrations,
    channels,
    nothing_stated,
    nuisances,
    of_filters,
    of_logger,
)
from diagnosis.recorded.record import Late, Record
from diagnosis.recorded.smoothed import noise_left, smoothed
from diagnosis.signals import pieces
from diagnosis.signals.mask import Mask
from laboratories.effects.effect import Effect
from laboratories.kind import Follows, Machine
from laboratories.kinds import KINDS
from loop import replay
from models.registry import Array
from models.system import System

# Share of a computed signal's rms below which a difference is rounding of the recording: four digits of a text file.
EXACT = 1e-4
UNREST = 0.05  # first value over the largest one from which on a record does not begin at rest
# A damper without a spring is replayed anew every PIECE seconds, since an error of force grows into a drift that hides
# all that is faster; a cubic over REACH ticks to each side (20 ms) gives its place and rate there. 0.1 N on 100 kg
# moves it by 30 µm in a piece, 1 N that changes sign every 10 mm at 0.2 m/s by 3 µm.
PIECE, REACH = 0.25, 10
HALF = 0.5  # of an interval, by which an output that holds its value is late on average
BENT = 8  # times as many steps, in which a command that bends is all but straight
# Systems of which a part keeps what they did: as many as the slopes of a fit take, and no more numbers than these.
PLAYED, NUMBERS = 8, 4_000_000
# Difference of two good solutions of one model over a measured signal's rms; nothing below is a gap where effects are
# named. The second is of two very good ones: solved in steps of 0.1 ms they differ by 1e-6 and less.
MODEL_ERROR, FINE_ERROR = 1e-3, 2e-5


class Part(Protocol):
    """A part of the test with its recorded inputs and outputs."""

    name: str
    role: str  # of the process that it belongs to
    signals: tuple[str, ...]
    nuisances: tuple[Nuisance, ...]
    candidates: tuple[Effect, ...]
    measured: Array  # (ticks, signals)
    present: Mask  # (ticks, signals)
    exact: bool  # computed, not measured: free of noise
    # (signals,) rms error that a prediction has because a measured motion that drives the part has one; 0 for none
    blurred: Array | float
    retimed: bool  # whether readings were moved in time, by what is known of a logger to some ten µs only

    @property
    def level(self) -> Array:
        """Rms of the readings (signals,) that a solution of the model may err by a share of."""

    @property
    def passes(self) -> Array:
        """Frequencies (signals,) up to which a logger passed the noise of each reading, Hz; inf where it passed all."""

    def predict(self, system: System) -> Array:
        """Outputs of the part without noise, (ticks, signals)."""

    def first(self, ticks: int) -> Part:
        """The part over the first ticks only."""


def cut(part: Any, ticks: int, inputs: Any) -> Any:
    """A copy of a part over its first ticks."""
    return with_fields(
        part, {"measured": part.measured[:ticks], "present": part.present[:ticks], "inputs": inputs}
    )


def with_fields(part: Any, fields: dict[str, Any]) -> Any:
    """A copy of a part with some of its fields replaced, which has not played any system yet."""
    result = copy.copy(part)
    for name, value in ({"played": (), "curved": None, "between": None} | fields).items():
        setattr(result, name, value)
    return result


def drift(record: Record, lab: RecordedLaboratory) -> Array | None:
    """The drift of the building (ticks,) that a laboratory follows, as its target, m; None where none was recorded."""
    coupling = lab.kind.coupling(lab.plan)
    if coupling.follows is not Follows.DRIFT or not record.has("displacement"):
        return None
    return coupling.ratio * followed(record.signals["displacement"], lab)


def outputs(record: Record, names: tuple[str, ...]) -> tuple[Array, Mask]:
    """Recorded signals (ticks, names) and where they are present; a signal that was not recorded is present nowhere."""
    none = np.zeros(record.ticks)
    values = [record.signals.get(name, none) for name in names]
    there = [record.present.get(name, none.astype(bool)) for name in names]
    return np.stack(values, axis=1), np.stack(there, axis=1)


def of_sites(record: Record, sites: Collection[str], plan: Plan) -> tuple[Effect, ...]:
    """The effects at these sites that change a waveform and that the plan's models can have.

    Noise and rounding are left out, since they are found in the samples directly, and of static data effects on rates.
    """
    found = [effect for effect in record.catalogue.values() if effect.site in sites and effect.fits(plan)]
    return tuple(one for one in found if not one.in_samples and not (one.timed and record.static))


class Measured:
    """What parts have in common whose readings stand for themselves."""

    measured: Array
    retimed = False
    blurred: Array | float = 0.0

    @property
    def level(self) -> Array:
        """Rms of the readings (signals,)."""
        return np.asarray(np.sqrt(np.mean(np.square(self.measured), axis=0)))

    @property
    def passes(self) -> Array:
        """No limit (signals,), Hz."""
        return np.full(self.measured.shape[1], np.inf)


class LaboratoryPart:
    """A laboratory replayed from its recorded commands."""

    exact = False
    blurred: Array | float = 0.0
    played: tuple[tuple[System, Array], ...] = ()  # systems with what they did, the newest last
    curved: Array | None = None  # what `bends` gives
    between: Finer | None = None  # what `finer` gives

    def __init__(self, record: Record, lab: RecordedLaboratory) -> None:
        self.lab, self.name, self.role = lab, lab.title, lab.role
        self.signals = lab.measured
        self.devices = lab.commands
        self.units = {name: record.unit(name) for name in self.devices}
        self.inputs = {name: record.signals.get(name, np.zeros(record.ticks)) for name in self.devices}
        stated = record.stated or ImportedData("")
        sent = {name: stated.channel(lab.role, name) for name in self.devices if record.has(name)}
        # what such a channel added to a command moved nothing, and is known at other frequencies than the motion's
        read = {name: self.inputs[name] for name, one in sent.items() if one.blunt}
        self.inputs |= {name: smoothed(values) for name, values in read.items()}
        self.unsure = {name: noise_left(values, record.plan.test.seed) for name, values in read.items()}
        self.wanted = self.targets(record)
        self.measured, self.present = outputs(record, self.signals)
        machines = [machine for machine in lab.kind.machines(lab.plan) if self.moves(record, machine)]
        seen = [machine for machine in machines if self.shows(record, machine)]
        names = tuple(name for machine in seen for name in machine.parameters)
        self.logged_by = channels(record.stated, lab)
        self.channels = self.logged_by  # further below, what readings passed that commands did not
        kept = at_rest(record.run)
        self.rest = tuple(kept.get((lab.role, channel)) for channel in lab.kind.channels.names)
        interval = record.plan.test.interval
        sampled = [one.interpolated or one.rate * interval > OWN_RATE for one in self.channels]
        self.retimed = record.retimed or any(sampled)
        self.free = nothing_stated(record.mapped, lab)
        mapped = channels(record.mapped, lab)
        self.delay_stated = any(one.delay_stated or one.delay or one.average for one in mapped)
        self.built_in = lab.kind.name in KINDS  # a user's kind has steps of its own within an interval
        # an actuator that holds its command from the tick on needs no straight lines
        held = lab.kind.name == COLUMN and lab.plan.actuator.command == "held"
        self.steps = 0 if held else record.steps if self.built_in else min(record.steps, 1)
        self.interval, self._decay = record.plan.test.interval, lab.kind.decay(lab.plan)
        late = 0.0 if self.steps else HALF * self.interval
        self.channels = beside_commands(self.logged_by, [*sent.values()], late)
        self.early = 0.0 if self.steps or record.numbered else self.interval
        self.nuisances = (*nuisances(lab, names), *calibrations(record, lab, self.channels))
        pairs = zip(self.signals, lab.kind.channels.names, self.measured.T, strict=True)
        sites = [
            f"sensor.{channel}" for name, channel, read in pairs if np.ptp(read) > 0.0 and record.has(name)
        ]
        sites += [machine.site for machine in seen]
        self.candidates = of_sites(record, set(map(lab.site, sites)), lab.plan)
        command = self.inputs[next(iter(self.inputs))]
        first, most = command[0], np.max(np.abs(command))
        self._start = float(first) if abs(first) > UNREST * most else 0.0
        self.anew, self.freed = self.beginnings(record), -1
        if lab.kind.drifts(lab.plan) and self.anew is not None:
            self.freed = self.signals.index(lab.signal(lab.kind.free))
        if self.anew is not None and not lab.kind.drifts(lab.plan) and self.rested(record.systems[lab.role]):
            self.anew = None
        self.blurred = unseen(self, record)

    def targets(self, record: Record) -> dict[str, Array]:
        """What moves the laboratory, by command, without the noise of its sensors that a controller feeds back.

        It is the target in the place of the transfer system's command, or the drift of the building that is its target.
        Where neither was recorded that command is left out: the readings predicted from it hold its motion, and its
        noise behind the lag of the machine only. Behind a filter of a logger that noise comes before that of readings.
        """
        channels = self.lab.kind.channels
        command, target = self.lab.signal(channels.command.name), self.lab.signal(channels.target.name)
        wanted = record.signals[target] if record.has(target) else drift(record, self.lab)
        known = {} if wanted is None else {command: wanted}
        return {
            name: known.get(name, values)
            for name, values in self.inputs.items()
            if name != command or name in known
        }

    def moves(self, record: Record, machine: Machine) -> bool:
        """Whether a machine is driven at all."""
        name = self.lab.signal(machine.drive)
        return not name or (record.has(name) and float(np.ptp(self.inputs[name])) > 0.0)

    def shows(self, record: Record, machine: Machine) -> bool:
        """Whether any of the signals that show a machine's effects was recorded."""
        return not machine.shown or any(record.has(self.lab.signal(name)) for name in machine.shown)

    def predict(self, system: System) -> Array:
        """Readings of the laboratory."""
        none = np.zeros(max(values.size for values in self.inputs.values()))
        drive = [self.inputs.get(name, none) for name in self.devices]
        drive += [none] * (2 - len(drive))
        found = replay.read(self.lab.kind, system, self.motion(system.unread, drive))
        found = through_logger(found, self.lab, system, self.channels, drive if self.steps == 0 else [])
        if self.steps == 0 and self.built_in:
            found = found + self.finer(drive).missed(system)
        if self.freed >= 0:
            found[:, self.freed] += self.begun_elsewhere(self.measured[:, self.freed] - found[:, self.freed])
        return found

    def finer(self, drive: list[Array]) -> Finer:
        """The plan's laboratory between the ticks."""
        if self.between is None:
            self.between = Finer(self.lab, self.channels, np.stack(drive, axis=1), self._start, self.anew)
        return self.between

    @property
    def passes(self) -> Array:
        """Frequencies (signals,) up to which the channels are stated to pass noise, Hz."""
        return np.array([channel.passes for channel in self.logged_by])

    @property
    def level(self) -> Array:
        """Rms of the readings (signals,), of a motion without a restoring force that of what forces did to it."""
        read = self.measured
        if self.freed >= 0:
            read = read.copy()
            read[:, self.freed] -= self.begun_elsewhere(read[:, self.freed])
        return np.asarray(np.sqrt(np.mean(np.square(read), axis=0)))

    def begun_elsewhere(self, missed: Array) -> Array:
        """What of the motion that a replay misses (ticks,) follows from where and how fast each piece begins."""
        there = self.present[:, self.freed]
        return pieces.begun(
            missed, there, np.asarray(self.anew)[:, 0].astype(int), self.interval, self._decay
        )

    def motion(self, system: System, drive: list[Array]) -> Array:
        """What sensors without error would read, (ticks, channels), of a system with such sensors.

        Many hypotheses of a search differ in their sensors only, so what was played last is kept.
        """
        known = next((motion for played, motion in self.played if played == system), None)
        if known is not None:
            return known
        found = self.stepped(system, drive, self.steps)
        if self.steps and self.built_in:
            found = found + self.bends(drive)
        self.played = (*self.played, (system, found))[-max(1, min(PLAYED, NUMBERS // found.size)) :]
        return found

    def stepped(self, system: System, drive: list[Array], steps: int) -> Array:
        """What sensors without error would read, (ticks, channels), with so many steps an interval."""
        return replay.motion(self.lab.kind, system, np.stack(drive, axis=1), self._start, self.anew, steps)

    def bends(self, drive: list[Array]) -> Array:
        """What a command that bends within a step adds to straight lines, (ticks, channels), by the plan's laboratory.

        Straight lines over a step h take (ω·h)²/12 of what a servo of frequency ω is commanded. That depends on what a
        fit moves in the second order only. A motor's command is held where an interval is one step, and does not bend.
        """
        if self.curved is None:
            plan = System(self.lab.plan).unread
            drive = [drive[0], np.zeros_like(drive[1])] if self.steps == 1 else drive
            few, many = (self.stepped(plan, drive, steps) for steps in (self.steps, BENT * self.steps))
            self.curved = many - few
        return self.curved

    def beginnings(self, record: Record) -> Array | None:
        """Ticks, displacements and rates from which a motion without a restoring force is replayed anew.

        Without a spring every error of force grows into a drift, so the motion is replayed piece by piece, each from
        the measured state. A record that does not begin at rest has one such beginning.
        """
        name = self.lab.signal(self.lab.kind.free)
        if not name or not record.has(name):
            return None
        motion, interval = record.signals[name], record.plan.test.interval
        free = self.lab.kind.drifts(self.lab.plan)
        if not free and abs(motion[0]) <= UNREST * float(np.max(np.abs(motion))):
            return None
        length = self._piece if free else motion.size
        rows = []
        for tick in range(0, motion.size - 2 * REACH, length):
            window = np.arange(max(0, tick - REACH), tick + REACH + 1)
            cubic = np.polynomial.polynomial.polyfit((window - tick) * interval, motion[window], 3)
            rows.append((tick, cubic[0], cubic[1]))
        return np.array(rows)

    @property
    def _piece(self) -> int:
        """Ticks of a piece of a motion without a restoring force."""
        return max(4 * REACH, round(PIECE / self.interval))

    def rested(self, system: System) -> bool:
        """Whether a replay from rest is nearer to the motion than one from the state that was read.

        Noise of a tenth of the motion looks like a beginning in motion, and a rate that is read from it is any rate.
        """
        place = self.signals.index(self.lab.signal(self.lab.kind.free))
        read, there = self.measured[:, place], self.present[:, place]
        moving, still = (
            float(np.sum(np.square(read - part.predict(system)[:, place])[there]))
            for part in (self.replaced(), self.replaced(anew=None))
        )
        return still < moving

    def first(self, ticks: int) -> LaboratoryPart:
        """The laboratory over the first ticks."""
        result: LaboratoryPart = cut(
            self, ticks, {name: values[:ticks] for name, values in self.inputs.items()}
        )
        if self.anew is not None:
            result.anew = self.anew[(self.anew[:, 0] < ticks - 2 * REACH) | (self.anew[:, 0] == 0)]
        return result

    def logged(self, late: Late, spread: float | None = None) -> LaboratoryPart:
        """The same laboratory with readings from a logger that delayed forces and other channels.

        What it does to one channel it mostly does to all, to forces as to the others; `spread` is the standard
        deviation of their delays, s. A stated delay or calibration stays; a stated filter's delay is known to a tenth.
        """
        lab, held = self.lab, self.interval if self.steps else 0.0
        retimed = self.retimed or max(late.force.about, late.motion.about) > BETWEEN
        delays = of_filters(lab, self.channels, held) or between_rows(lab, self.channels)
        if self.free:
            delays = of_logger(lab, late, spread, held, self.early)
        if any(channel.calibration > 0.0 for channel in self.channels):
            return self.replaced(nuisances=(*self.nuisances, *delays), retimed=retimed)
        gain = LoggedReadings("gain", CALIBRATED, self.lab, self.lab.kind.channels.names)
        return self.replaced(nuisances=(*self.nuisances, *delays, gain), retimed=retimed)

    def another_test(self, inputs: dict[str, Array]) -> LaboratoryPart:
        """The same laboratory from rest on under other commands (ticks,), with readings of zero.

        A motion without a restoring force is cut into pieces there as well, of which each begins at rest.
        """
        ticks = max(values.size for values in inputs.values())
        starts = np.arange(0, ticks, self._piece) if self.freed >= 0 else np.zeros(0)
        return self.replaced(
            inputs=inputs,
            measured=np.zeros((ticks, len(self.signals))),
            present=np.broadcast_to(self.present.any(axis=0), (ticks, len(self.signals))),
            anew=np.column_stack([starts, np.zeros((starts.size, 2))]) if self.freed >= 0 else None,
            _start=0.0,
        )

    def replaced(self, **fields: Any) -> LaboratoryPart:
        """The same laboratory in another test: other inputs, or other readings."""
        return with_fields(self, fields)
