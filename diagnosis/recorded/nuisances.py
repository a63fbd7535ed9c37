"""Unknowns that a fit moves beside the effects: nominal parameters within tolerances, and properties of a logger."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from common.plan.plan import Plan
from common.recording.imported import NOTHING_STATED, ImportedChannel, ImportedData
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.record import Late, Record
from models.system import SensorEffects, System

# Standard deviations within which a logger's channels are expected. LATE: a filter of 40 Hz, usual before sampling at
# 100 Hz to 200 Hz, delays by 4 ms. ALIKE and UNLIKE: channels of one logger differ by a quarter of an interval or by
# half of their delay, so that a channel without delay is two tolerances off. CALIBRATED: load cells and displacement
# transducers are calibrated to a percent.
LATE = 4e-3  # s
ALIKE = 5e-4  # s
UNLIKE = 0.5
CALIBRATED = 0.01
EVENLY = 3.0**-0.5  # rms of what is anywhere from zero to a bound, over that bound
HELD = 2e-3  # s, for which a controller holds a command at most, as a rule
# Rows in an interval from which on they are not the controller's own, but of a converter that may take its channels in
# turn, some ten µs apart.
OWN_RATE = 1.03
# Standard deviation of the delay of a stated filter. PASSING: an analogue filter's parts are good to some per cent, and
# a digital one that loses 3 dB at the same frequency, 100 Hz sampled at 500 Hz, delays slow motion by 13 % less.
# BETWEEN: what readings do between ticks, as after the steps of a command, is known no better.
PASSING, BETWEEN = 0.1, 5e-5  # share, s


@dataclass(frozen=True)
class Nuisance:
    """A nominal parameter that may move within its tolerance, of the building or of a laboratory."""

    parameter: str  # table.name of the plan
    tolerance: float
    lab: RecordedLaboratory | None = None
    storey: int = field(default=0, kw_only=True)  # the only storey whose value moves, from 1; 0 for all
    of_record = False  # whether it belongs to the recording alone and changes nothing of the test

    @property
    def name(self) -> str:
        """The name in reports: part.parameter, with the storey where only one storey's value moves."""
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
        return system if z == 0.0 else system.recorded(self.signal, gain=1.0 + z * self.tolerance)


@dataclass(frozen=True)
class LoggedForce(Nuisance):
    """Delay (s), gain, zero (N) or drift of it (N/s) with which a logger recorded a force that the master used."""

    of_record = True
    signal: str = ""  # of the force's reading
    about: float = 0.0  # s, the delay at z = 0

    def moved(self, system: System, z: float) -> System:
        """The system whose reading of that force has the logger's delay, gain, zero or drift."""
        value = z * self.tolerance
        if self.parameter == "delay":
            return system.recorded(self.signal, delay=self.about + value)
        if self.parameter == "gain":
            return system.recorded(self.signal, gain=1.0 + value)
        own = system.effects.sensors.get(self.signal, SensorEffects())
        made = {
            **system.effects.sensors,
            self.signal: replace(own, **{self.parameter: getattr(own, self.parameter) + value}),
        }
        return replace(system, effects=replace(system.effects, sensors=made))


@dataclass(frozen=True)
class LoggedReadings(Nuisance):
    """Delay (s), about the one found elsewhere, or gain with which a logger recorded readings of a laboratory.

    A logger whose filter is stated may delay by less than that filter; one of which nothing is stated records nothing
    earlier than `least`. Up to `held` any delay is as likely as another one; what is beyond it is the logger's.
    """

    of_record = True
    signals: tuple[str, ...] = ()  # of the readings in their laboratory
    about: float = 0.0  # s, the delay at z = 0
    least: float = 0.0  # s, of the delay
    held: float = 0.0  # s, that a command may be held before it acts

    def moved(self, system: System, z: float) -> System:
        """The system whose readings have that gain, or that delay."""
        if self.parameter == "gain":
            values = {"gain": 1.0 + z * self.tolerance}
        else:
            values = {"delay": max(self.least, self.about + self.late(z))}
        if values in ({"gain": 1.0}, {"delay": 0.0}):
            return system
        return system.recorded(*self.signals, **values)

    def late(self, z: float) -> float:
        """The delay (s) that is `z` standard deviations from the one expected."""
        both = math.hypot(self.tolerance, EVENLY * self.held)
        inside = min(abs(z), self.held / both)
        return math.copysign(both * inside + self.tolerance * (abs(z) - inside), z)


def nuisances(lab: RecordedLaboratory, names: tuple[str, ...]) -> tuple[Nuisance, ...]:
    """The parameters of a laboratory that can move, of those with these names."""
    found = ((name, lab.kind.planned(lab.plan, name), lab.kind.tolerance(lab.plan, name)) for name in names)
    return tuple(
        Nuisance(name, tolerance, lab) for name, value, tolerance in found if movable(value, tolerance)
    )


def of_building(plan: Plan) -> tuple[Nuisance, ...]:
    """The parameters of the building that can move; storeys with a value of their own move one by one."""
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

    Entries of a matrix move together, so that it stays symmetric; so do all values beside `[structure.experimental]`.
    """
    several = isinstance(values, tuple) and len(values) > 1 and not isinstance(values[0], tuple)
    return several and plan.structure.experimental is None


def movable(value: Any, tolerance: float) -> bool:
    """Whether a parameter's values are finite and not zero, and uncertain at all."""
    values = np.asarray(value)
    return tolerance > 0.0 and bool(np.all(np.isfinite(values)) and np.all(values != 0.0))


def channels(stated: ImportedData | None, lab: RecordedLaboratory) -> tuple[ImportedChannel, ...]:
    """The properties of the logger's channels of a laboratory; neutral ones where rths recorded the test itself."""
    if stated is None:
        return (NOTHING_STATED,) * len(lab.measured)
    return tuple(stated.channel(lab.role, name) for name in lab.kind.channels.names)


def of_logger(
    lab: RecordedLaboratory, late: Late, spread: float | None, held: float = 0.0, early: float = 0.0
) -> tuple[LoggedReadings, ...]:
    """Delays of force readings and of the others by a logger of which nothing is stated, about those found elsewhere.

    `spread` is their standard deviation, s; None for what is usual. `held` is the longest that a command may be held
    between rows, s, and `early` the longest after a tick that a logger may read what belongs to it.
    """
    rows, groups = lab.kind.channels.measured, ((late.force, True), (late.motion, False))
    return tuple(
        LoggedReadings(
            "delay",
            spread or math.hypot(max(ALIKE, UNLIKE * about), unsure),
            lab,
            those,
            about,
            -min(early, HELD),
            0.0 if spread else min(held, HELD),
        )
        for (about, unsure), force in groups
        if (those := tuple(row.name for row in rows if (row.unit == "N") == force))
    )


def of_filters(
    lab: RecordedLaboratory, stated: Sequence[ImportedChannel], held: float = 0.0
) -> tuple[LoggedReadings, ...]:
    """By how much forces, and other readings, of which a filter is stated are late beyond that and their delay.

    `held` is the longest that a command may be held between rows, s.
    """
    result = []
    for force in (True, False):
        rows = zip(lab.kind.channels.measured, stated, strict=True)
        those = {row.name: one.filter for row, one in rows if one.filter and (row.unit == "N") == force}
        if those:
            late = max(ImportedChannel(one).late for one in those.values())
            known = math.hypot(PASSING * late, BETWEEN)
            result.append(
                LoggedReadings("delay", known, lab, tuple(those), least=-late, held=min(held, HELD))
            )
    return tuple(result)


def between_rows(lab: RecordedLaboratory, stated: Sequence[ImportedChannel]) -> tuple[LoggedReadings, ...]:
    """By how much all readings are late beyond stated delays, where their rows lie between ticks.

    What a controller holds tells between which two rows a tick is, not where. So it is with rows as fast as the ticks
    that came late: another device wrote them, whose rows are in step by no more than the times say. Of faster rows that
    may be in step, and are taken to be so, a tick may lie up to a row before its own.
    """
    interval, rated = lab.plan.test.interval, [one for one in stated if one.rate > 0.0]
    apart = [one.rate for one in rated if one.interpolated or one.delay > 0.0]
    steady = [one.rate for one in rated if one.rate * interval > OWN_RATE]
    if not apart and not steady:
        return ()
    row = 1.0 / max(apart or steady)
    known = EVENLY * (0.5 * row if apart else row)
    return (LoggedReadings("delay", known, lab, lab.kind.channels.names, least=-row),)


def nothing_stated(mapped: ImportedData | None, lab: RecordedLaboratory) -> bool:
    """Whether the import map states neither filter nor mean nor delay for any channel of a laboratory."""
    return not any(
        one.filter or one.delay_stated or one.delay or one.average for one in channels(mapped, lab)
    )


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
