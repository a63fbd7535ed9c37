"""The pieces that a recording can be judged by, one after the other, each from its own recorded inputs.

A piece is driven by commands that are known exactly, so what it predicts differs from what was read by
the sensors' noise alone as long as its model is right. A gap in one piece does not spill into another.
"""

from __future__ import annotations

import copy
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from common.plan.plan import Plan
from common.recording.imported import NOTHING_STATED, ImportedChannel
from common.roles import MASTER
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.record import Record
from diagnosis.signals.mask import Mask
from laboratories.effects.effect import Effect
from laboratories.kind import Machine
from loop import replay
from models.registry import Array
from models.system import System

EXACT = 1e-4  # share of a computed signal's rms below which a difference is rounding, not gap
UNREST = 0.05  # share of its largest value from which on a first value is no rest
PIECE, REACH = 1.0, 10  # s between beginnings of a free damper, ticks to each side that they are read from
LATE = 4e-3  # s, by which a logger's filters usually make a force late
ALIKE = 5e-4  # s, by which a logger's channels may differ: a quarter of an interval,
UNLIKE = 0.5  # and this share of a delay, so that a channel on time is no more than two tolerances off
CALIBRATED = 0.01  # by which a logger's calibration usually differs
MODEL_ERROR = 1e-3  # share of a measured signal's rms that two good solutions of one model may differ by


@dataclass(frozen=True)
class Nuisance:
    """A nominal parameter that may move within its tolerance, of the building or of a laboratory."""

    parameter: str  # table.name of the plan
    tolerance: float
    lab: RecordedLaboratory | None = None
    storey: int = field(default=0, kw_only=True)  # whose value alone moves, from 1; 0: all
    of_record = False  # whether it says something of the recording alone, and nothing of the test

    @property
    def name(self) -> str:
        """The name in reports: part.parameter, and of one storey alone which."""
        if self.storey:
            return f"{self.parameter} of storey {self.storey}"
        return self.lab.site(self.parameter) if self.lab else self.parameter

    def moved(self, system: System, z: float) -> System:
        """The system with the parameter moved by `z` tolerances."""
        if z == 0.0:
            return system
        factor = 1.0 + z * self.tolerance
        if self.lab:
            return self.lab.kind.scaled(system, self.parameter, factor)
        table, _, key = self.parameter.partition(".")
        if not self.storey:
            return system.scaled(table, key, factor)
        values = getattr(getattr(system.plan, table), key)
        place = self.storey - 1
        return system.moved(table, **{key: (*values[:place], factor * values[place], *values[self.storey :])})


@dataclass(frozen=True)
class ChannelGain(Nuisance):
    """The calibration of one channel of a logger, within the tolerance stated for it."""

    of_record = True
    signal: str = ""  # of the reading in its laboratory

    @property
    def name(self) -> str:
        """The name in reports."""
        site = f"sensor.{self.signal}"
        return f"{self.lab.site(site) if self.lab else site}.calibration"

    def moved(self, system: System, z: float) -> System:
        """The system whose reading has that gain."""
        return system if z == 0.0 else system.sensed(self.signal, gain=1.0 + z * self.tolerance)


@dataclass(frozen=True)
class LoggedForce(Nuisance):
    """How late a logger recorded a force that the master used, in seconds, or by what factor."""

    of_record = True
    signal: str = ""  # of the force's reading

    def moved(self, system: System, z: float) -> System:
        """The system whose reading of that force says what the logger did to it."""
        value = z * self.tolerance
        return system.sensed(
            self.signal, **({"delay": value} if self.parameter == "delay" else {"gain": 1.0 + value})
        )


@dataclass(frozen=True)
class LoggedReadings(Nuisance):
    """How late a logger recorded all readings of a laboratory, in seconds, about what it made of another one."""

    of_record = True
    signals: tuple[str, ...] = ()  # of the readings in their laboratory
    about: float = 0.0  # s

    def moved(self, system: System, z: float) -> System:
        """The system whose readings all come that late; none comes early."""
        delay = max(0.0, self.about + z * self.tolerance)
        for name in self.signals if delay > 0.0 else ():
            system = system.sensed(name, delay=delay)
        return system


class Part(Protocol):
    """A piece of the test with its recorded inputs and outputs."""

    name: str
    role: str  # of whom it is
    signals: tuple[str, ...]
    nuisances: tuple[Nuisance, ...]
    candidates: tuple[Effect, ...]
    measured: Array  # (ticks, signals)
    present: Mask  # (ticks, signals)
    exact: bool  # computed, not measured: free of noise

    def predict(self, system: System) -> Array:
        """What the piece would have given, without noise; (ticks, signals)."""

    def first(self, ticks: int) -> Part:
        """The piece over the first ticks only."""


def nuisances(lab: RecordedLaboratory, names: tuple[str, ...]) -> tuple[Nuisance, ...]:
    """Those of a laboratory's parameters that can move: finite and not zero."""
    found = ((name, lab.kind.planned(lab.plan, name), lab.kind.tolerance(lab.plan, name)) for name in names)
    return tuple(
        Nuisance(name, tolerance, lab) for name, value, tolerance in found if movable(value, tolerance)
    )


def of_building(plan: Plan) -> tuple[Nuisance, ...]:
    """Those of the building's parameters that can move; each storey's by itself, as far as it has one of its own."""
    known, result = plan.tolerances, []
    for key in ("mass", "stiffness", "damping", "damping_ratio"):
        name, values = f"structure.{key}", getattr(plan.structure, key)
        tolerance = known.parameters.get(name, known.default)
        if movable(values, tolerance):
            storeys = range(1, len(values) + 1) if apart(plan, values) else (0,)
            result += [Nuisance(name, tolerance, storey=storey) for storey in storeys]
    return tuple(result)


def apart(plan: Plan, values: Any) -> bool:
    """Whether a parameter of the building has values of several storeys that may be wrong one by one.

    Those of a matrix are not: it stays symmetric. What `[structure.experimental]` takes over belongs to all of them.
    """
    several = isinstance(values, tuple) and len(values) > 1 and not isinstance(values[0], tuple)
    return several and plan.structure.experimental is None


def movable(value: Any, tolerance: float) -> bool:
    """Whether a parameter's values are finite and not zero, and uncertain at all."""
    values = np.asarray(value)
    return tolerance > 0.0 and bool(np.all(np.isfinite(values)) and np.all(values != 0.0))


def cut(part: Any, ticks: int, inputs: Any) -> Any:
    """A copy of a part over its first ticks."""
    return with_fields(
        part, {"measured": part.measured[:ticks], "present": part.present[:ticks], "inputs": inputs}
    )


def with_fields(part: Any, fields: dict[str, Any]) -> Any:
    """A copy of a part with some of its fields replaced."""
    result = copy.copy(part)
    for name, value in fields.items():
        setattr(result, name, value)
    return result


def outputs(record: Record, names: tuple[str, ...]) -> tuple[Array, Mask]:
    """Recorded signals and where they are there; one that is absent is nowhere there."""
    none = np.zeros(record.ticks)
    values = [record.signals.get(name, none) for name in names]
    there = [record.present.get(name, none.astype(bool)) for name in names]
    return np.stack(values, axis=1), np.stack(there, axis=1)


def of_sites(record: Record, sites: Collection[str], plan: Plan) -> tuple[Effect, ...]:
    """The effects on these sites that change a waveform and that the plan's models can have.

    Noise and rounding are seen directly.
    """
    found = [effect for effect in record.catalogue.values() if effect.site in sites and effect.fits(plan)]
    return tuple(effect for effect in found if not effect.in_samples)


def channels(record: Record, lab: RecordedLaboratory) -> tuple[ImportedChannel, ...]:
    """What is stated of the logger's channels of a laboratory's readings, nothing where rths recorded them."""
    stated = record.stated
    if stated is None:
        return (NOTHING_STATED,) * len(lab.measured)
    return tuple(stated.channel(lab.role, name) for name in lab.kind.channels.names)


def calibrations(
    record: Record, lab: RecordedLaboratory, stated: tuple[ImportedChannel, ...]
) -> tuple[ChannelGain, ...]:
    """Gains of the channels that were recorded, within the tolerances stated."""
    rows = zip(lab.kind.channels.names, lab.measured, stated, strict=True)
    return tuple(
        ChannelGain("gain", channel.calibration, lab, name)
        for name, given, channel in rows
        if channel.calibration > 0.0 and record.has(given)
    )


class LaboratoryPart:
    """A laboratory from its recorded commands."""

    exact = False

    def __init__(self, record: Record, lab: RecordedLaboratory) -> None:
        self.lab, self.name, self.role = lab, lab.title, lab.role
        self.signals = lab.measured
        self.devices = lab.commands
        self.units = {name: record.unit(name) for name in self.devices}
        none = np.zeros(record.ticks)
        self.inputs = {name: record.signals.get(name, none) for name in self.devices}
        self.wanted = self.inputs | self.targets(record)
        self.measured, self.present = outputs(record, self.signals)
        machines = [machine for machine in lab.kind.machines(lab.plan) if self.moves(record, machine)]
        names = tuple(name for machine in machines for name in machine.parameters)
        self.channels = channels(record, lab)
        self._interval = record.plan.test.interval
        self.nuisances = (*nuisances(lab, names), *calibrations(record, lab, self.channels))
        pairs = zip(self.signals, lab.kind.channels.names, self.measured.T, strict=True)
        sites = [
            f"sensor.{channel}" for name, channel, read in pairs if np.ptp(read) > 0.0 and record.has(name)
        ]
        sites += [machine.site for machine in machines if self.shows(record, machine)]
        self.candidates = of_sites(record, set(map(lab.site, sites)), lab.plan)
        self.anew = self.beginnings(record)
        command = self.inputs[next(iter(self.inputs))]
        first, most = command[0], np.max(np.abs(command))
        self._start = float(first) if abs(first) > UNREST * most else 0.0

    def targets(self, record: Record) -> dict[str, Array]:
        """What commands were to bring about, by command: free of the sensors' noise that a controller feeds back."""
        channels = self.lab.kind.channels
        command, target = self.lab.signal(channels.command.name), self.lab.signal(channels.target.name)
        return {command: record.signals[target]} if command in self.inputs and record.has(target) else {}

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
        found = replay.laboratory(self.lab.kind, system, np.stack(drive, axis=1), self._start, self.anew)
        for place, channel in enumerate(self.channels):
            if channel.filter is not None or channel.delay != 0.0:
                found[:, place] = channel.through(found[:, place], self._interval)
        return found

    def beginnings(self, record: Record) -> Array | None:
        """Ticks, places and rates from which a motion that nothing brings back is replayed anew.

        Without a spring every error of force adds up to a drift for ever, so it is replayed piece by piece, each from
        the measured motion. The same where a record does not begin at rest.
        """
        name = self.lab.signal(self.lab.kind.free)
        if not name or not record.has(name):
            return None
        motion, interval = record.signals[name], record.plan.test.interval
        free = self.lab.kind.drifts(self.lab.plan)
        if not free and abs(motion[0]) <= UNREST * float(np.max(np.abs(motion))):
            return None
        length = max(4 * REACH, round(PIECE / interval)) if free else motion.size
        rows = []
        for tick in range(0, motion.size - 2 * REACH, length):
            window = np.arange(max(0, tick - REACH), tick + REACH + 1)
            cubic = np.polynomial.polynomial.polyfit((window - tick) * interval, motion[window], 3)
            rows.append((tick, cubic[0], cubic[1]))
        return np.array(rows)

    def first(self, ticks: int) -> LaboratoryPart:
        """The laboratory over the first ticks."""
        result: LaboratoryPart = cut(
            self, ticks, {name: values[:ticks] for name, values in self.inputs.items()}
        )
        if self.anew is not None:
            result.anew = self.anew[self.anew[:, 0] < ticks]
        return result

    def logged(self, delay: float) -> LaboratoryPart:
        """The same laboratory, whose readings came through a logger that made the forces used late by `delay` s.

        What a logger does to one channel it mostly does to all; nothing of what is stated of it is changed.
        """
        if any(channel.filter is not None or channel.delay != 0.0 for channel in self.channels):
            return self
        about = max(0.0, delay)
        tolerance = max(ALIKE, UNLIKE * about)
        late = LoggedReadings("delay", tolerance, self.lab, self.lab.kind.channels.names, about)
        return self.replaced(nuisances=(*self.nuisances, late))

    def replaced(self, **fields: Any) -> LaboratoryPart:
        """The same laboratory in another test: other inputs, or other readings."""
        return with_fields(self, fields)


class ColumnAlone:
    """The column from its measured deformation, where no actuator command was recorded."""

    name = "column"
    exact = False

    def __init__(self, record: Record, lab: RecordedLaboratory) -> None:
        self.lab, self.role = lab, lab.role
        displacement, force = lab.kind.channels.position, lab.kind.channels.force
        self.signals: tuple[str, ...] = (lab.signal(force),)
        self.inputs = record.signals[lab.signal(displacement)]
        self.measured, self.present = outputs(record, self.signals)
        machine = next(item for item in lab.kind.machines(lab.plan) if item.site == "column")
        self.nuisances = nuisances(lab, machine.parameters)
        sites = (lab.site("column"), lab.site(f"sensor.{force}"))
        self.candidates = of_sites(record, sites, lab.plan)

    def predict(self, system: System) -> Array:
        """Force readings."""
        return replay.column(system, self.inputs)[:, None]

    def first(self, ticks: int) -> ColumnAlone:
        """The column over the first ticks."""
        result: ColumnAlone = cut(self, ticks, self.inputs[:ticks])
        return result


class Building:
    """The numerical substructure from the ground motion and the forces that the master used.

    It is exact where the forces recorded are those that the master used to the last bit, else they came through a
    logger of their own.
    """

    name = "structure"
    role = MASTER
    exact = True
    signals: tuple[str, ...] = ("displacement", "velocity", "acceleration")

    def __init__(self, record: Record) -> None:
        plan, none = record.plans[MASTER], np.zeros(record.ticks)
        own, other = record.own, record.other
        if record.whole is not None:
            used = record.whole.used
        elif other is not None:
            used = record.signals[f"{other.kind.channels.force}_used"][:, None]
        else:
            used = np.zeros((record.ticks, 0))
        names = (own.kind.channels.position, own.kind.channels.force) if own else ()
        read = [record.signals[name] for name in names] or [none, none]
        self._inputs = (read[0], read[1], used)
        self._force = own.kind.channels.force if own else ""
        self._interval = record.plan.test.interval
        here = record.signals["ground_acceleration"]
        self._ground = np.zeros((2, record.ticks + 1))
        self._ground[0, :-1] = here
        storeys = plan.storeys
        self.signals = tuple(name for name in type(self).signals for _ in range(storeys))
        columns = [
            record.signals[name].reshape(record.ticks, -1)[:, i]
            for name in ("displacement", "velocity", "acceleration")
            for i in range(storeys)
        ]
        self.measured = np.stack(columns, axis=1)
        self.present = np.repeat(record.present["displacement"][:, None], self.measured.shape[1], axis=1)
        self.nuisances = of_building(plan)
        self.candidates = of_sites(record, ("structure",), plan)

    def predict(self, system: System) -> Array:
        """Displacement, velocity and acceleration of every storey."""
        rows = replay.building(system, self._ground, *self.forces(system))
        return np.column_stack([rows[name] for name in type(self).signals])

    @property
    def ground(self) -> Array:
        """Ground acceleration (ticks,)."""
        return self._ground[0, :-1]

    def forces(self, system: System) -> tuple[Array, Array, Array]:
        """Position and force of the master's laboratory and the forces of the others, as the master used them."""
        position, force, used = self._inputs
        logger = None if self.exact else system.effects.sensors.get(self._force)
        if logger is None:
            return position, force, used
        ticks = np.arange(force.size)
        return position, np.interp(ticks + logger.delay / self._interval, ticks, force) / logger.gain, used

    def logged(self) -> Building:
        """The same building, of which the forces that the master used are known up to a logger's noise only."""
        logger = tuple(
            LoggedForce(name, tolerance, None, self._force)
            for name, tolerance in (("delay", LATE), ("gain", CALIBRATED))
            if self._force
        )
        result: Building = with_fields(self, {"exact": False, "nuisances": (*self.nuisances, *logger)})
        return result

    def late(self, z: Array) -> float:
        """By how much a logger recorded the force too late, s, at places (nuisances,) of a fit."""
        rows = zip(self.nuisances, z, strict=True)
        return sum(
            float(x) * one.tolerance
            for one, x in rows
            if isinstance(one, LoggedForce) and one.parameter == "delay"
        )

    def first(self, ticks: int) -> Building:
        """The whole of it, because it is computed and cheap."""
        return self
