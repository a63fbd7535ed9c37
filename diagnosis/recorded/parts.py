"""The pieces that a recording can be judged by, one after the other, each from its own recorded inputs.

A piece is driven by commands that are known exactly, so what it predicts differs from what was read by
the sensors' noise alone as long as its model is right. A gap in one piece does not spill into another.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any, ClassVar, Protocol

import numpy as np

from common.plan.plan import Plan
from diagnosis.recorded.record import Record
from diagnosis.signals.mask import Mask
from laboratories import effects
from laboratories.column.kind import COLUMN
from laboratories.effects.effect import Effect
from laboratories.table.kind import TABLE
from loop import replay
from models.registry import Array
from models.system import System

EXACT = 1e-4  # share of a computed signal's rms below which a difference is rounding, not gap
UNREST = 0.05  # share of its largest value from which on a first value is no rest
PIECE, REACH = 1.0, 10  # s between beginnings of a free damper, ticks to each side that they are read from
MODEL_ERROR = 1e-3  # share of a measured signal's rms that two good solutions of one model may differ by


@dataclass(frozen=True)
class Nuisance:
    """A nominal parameter that may move within its tolerance."""

    table: str
    field: str
    tolerance: float

    @property
    def name(self) -> str:
        """The name in reports: part.parameter."""
        return f"{self.table}.{self.field}"

    def moved(self, system: System, z: float) -> System:
        """The system with the parameter moved by `z` tolerances."""
        return system if z == 0.0 else system.scaled(self.table, self.field, 1.0 + z * self.tolerance)


class Part(Protocol):
    """A piece of the test with its recorded inputs and outputs."""

    name: str
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


def nuisances(record: Record, fields: tuple[tuple[str, str], ...]) -> tuple[Nuisance, ...]:
    """Those of the parameters that can move: finite and not zero."""
    known, result = record.plan.tolerances, []
    for table, field in fields:
        value = np.asarray(attrgetter(f"{table}.{field}")(record.plan))
        tolerance = known.parameters.get(f"{table}.{field}", known.default)
        if tolerance > 0.0 and np.all(np.isfinite(value)) and np.all(value != 0.0):
            result.append(Nuisance(table, field, tolerance))
    return tuple(result)


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


def of_sites(sites: tuple[str, ...], plan: Plan) -> tuple[Effect, ...]:
    """The catalogue's effects on these sites that change a waveform and that the plan's models can have.

    Noise and rounding are seen directly.
    """
    found = [effect for effect in effects.CATALOGUE.values() if effect.site in sites and effect.fits(plan)]
    return tuple(effect for effect in found if not effect.in_samples)


ACTUATOR = {
    "fopdt": ("gain", "delay", "time_constant"),
    "servo_hydraulic": (
        "servo.gain",
        "servo.valve",
        "servo.valve_damping",
        "servo.valve_stiffness",
        "servo.leakage",
        "servo.piston",
        "servo.delay",
    ),
}
OF_COLUMN = (("column", "stiffness"), ("column", "mass"), ("column", "damping"))


class LaboratoryA:
    """Actuator and column from the recorded actuator command."""

    name = "laboratory A"
    exact = False
    signals: tuple[str, ...] = COLUMN.channels.names

    devices: ClassVar[dict[str, str]] = {"actuator_command": "actuator"}
    units: ClassVar[dict[str, str]] = {"actuator_command": "m"}

    def __init__(self, record: Record) -> None:
        self.inputs = {"actuator_command": record.signals["actuator_command"]}
        first, most = self.inputs["actuator_command"][0], np.max(np.abs(self.inputs["actuator_command"]))
        self._start = float(first) if abs(first) > UNREST * most else 0.0
        self.measured, self.present = outputs(record, COLUMN.channels.names)
        self.nuisances = nuisances(
            record,
            tuple(("actuator", name) for name in ACTUATOR[record.plan.actuator.model]) + OF_COLUMN,
        )
        sites = ["actuator", *(f"sensor.{name}" for name in COLUMN.channels.names if record.has(name))]
        with_column = (*sites, "column") if record.has("column_force") else tuple(sites)
        self.candidates = of_sites(with_column, record.plan)

    def predict(self, system: System) -> Array:
        """Readings of the laboratory."""
        return replay.laboratory_a(system, self.inputs["actuator_command"], self._start)

    def first(self, ticks: int) -> LaboratoryA:
        """The laboratory over the first ticks."""
        result: LaboratoryA = cut(self, ticks, {name: values[:ticks] for name, values in self.inputs.items()})
        return result

    def replaced(self, **fields: Any) -> LaboratoryA:
        """The same laboratory in another test: other inputs, or other readings."""
        return with_fields(self, fields)


class ColumnAlone:
    """The column from its measured deformation, where no actuator command was recorded."""

    name = "column"
    exact = False
    signals: tuple[str, ...] = ("column_force",)

    def __init__(self, record: Record, deformation: Array) -> None:
        self.inputs = deformation
        self.measured, self.present = outputs(record, self.signals)
        self.nuisances = nuisances(record, OF_COLUMN)
        self.candidates = of_sites(("column", "sensor.column_force"), record.plan)

    def predict(self, system: System) -> Array:
        """Force readings."""
        return replay.column(system, self.inputs)[:, None]

    def first(self, ticks: int) -> ColumnAlone:
        """The column over the first ticks."""
        result: ColumnAlone = cut(self, ticks, self.inputs[:ticks])
        return result


class LaboratoryB:
    """Table and damper from the recorded table and motor commands."""

    name = "laboratory B"
    exact = False
    signals: tuple[str, ...] = TABLE.channels.names
    devices: ClassVar[dict[str, str]] = {"table_command": "table", "damper_command": "damper's motor"}
    units: ClassVar[dict[str, str]] = {"table_command": "m", "damper_command": "N"}

    def __init__(self, record: Record) -> None:
        none = np.zeros(record.ticks)
        self.inputs = {name: record.signals.get(name, none) for name in self.devices}
        self.measured, self.present = outputs(record, TABLE.channels.names)
        driven = record.has("table_command") and float(np.ptp(self.inputs["table_command"])) > 0.0
        self.nuisances = nuisances(record, (*OF_TABLE, *OF_DAMPER) if driven else OF_DAMPER)
        moving = [
            name
            for name, values in zip(TABLE.channels.names, self.measured.T, strict=True)
            if np.ptp(values) > 0.0
        ]
        sites = [f"sensor.{name}" for name in moving if record.has(name)] + (["table"] if driven else [])
        self.anew = self.beginnings(record)
        with_damper = record.has("damper_stroke") or record.has("damper_force")
        self.candidates = of_sites((*sites, "damper") if with_damper else tuple(sites), record.plan)

    def predict(self, system: System) -> Array:
        """Readings of the laboratory."""
        none = np.zeros(max(values.size for values in self.inputs.values()))
        command, motor = (self.inputs.get(name, none) for name in self.devices)
        return replay.laboratory_b(system, command, motor, self.anew)

    def beginnings(self, record: Record) -> Array | None:
        """Ticks, strokes and rates from which a damper that nothing brings back is replayed anew.

        Without a spring every error of force adds up to a drift for ever, so it is replayed piece by piece, each from
        the measured motion. The same where a record does not begin at rest.
        """
        if not record.has("damper_stroke"):
            return None
        stroke, interval = record.signals["damper_stroke"], record.plan.test.interval
        free = record.plan.damper.stiffness == 0.0
        if not free and abs(stroke[0]) <= UNREST * float(np.max(np.abs(stroke))):
            return None
        length = max(4 * REACH, round(PIECE / interval)) if free else stroke.size
        rows = []
        for tick in range(0, stroke.size - 2 * REACH, length):
            window = np.arange(max(0, tick - REACH), tick + REACH + 1)
            cubic = np.polynomial.polynomial.polyfit((window - tick) * interval, stroke[window], 3)
            rows.append((tick, cubic[0], cubic[1]))
        return np.array(rows)

    def first(self, ticks: int) -> LaboratoryB:
        """The laboratory over the first ticks."""
        result: LaboratoryB = cut(self, ticks, {name: values[:ticks] for name, values in self.inputs.items()})
        if self.anew is not None:
            result.anew = self.anew[self.anew[:, 0] < ticks]
        return result

    def replaced(self, **fields: Any) -> LaboratoryB:
        """The same laboratory in another test: other inputs, or other readings."""
        return with_fields(self, fields)


OF_TABLE = (
    ("table", "frequency"),
    ("table", "damping_ratio"),
    ("table", "delay"),
)
OF_DAMPER = (
    ("damper", "mass"),
    ("damper", "stiffness"),
    ("damper", "damping"),
    ("damper", "motor_time_constant"),
)


class Building:
    """The numerical substructure from the ground motion and the forces that the master used."""

    name = "structure"
    exact = True
    signals: tuple[str, ...] = ("displacement", "velocity", "acceleration")

    def __init__(self, record: Record) -> None:
        self._whole = record.whole
        dampers = record.signals["damper_force_used"] if self._whole is None else self._whole.dampers
        self._inputs = (record.signals["column_displacement"], record.signals["column_force"], dampers)
        here = record.signals["ground_acceleration"]
        self._ground = np.zeros((2, record.ticks + 1))
        self._ground[0, :-1] = here
        storeys = record.plan.storeys
        self.signals = tuple(name for name in type(self).signals for _ in range(storeys))
        columns = [
            record.signals[name].reshape(record.ticks, -1)[:, i]
            for name in ("displacement", "velocity", "acceleration")
            for i in range(storeys)
        ]
        self.measured = np.stack(columns, axis=1)
        self.present = np.repeat(record.present["displacement"][:, None], self.measured.shape[1], axis=1)
        self.nuisances = nuisances(
            record, tuple(("structure", name) for name in ("mass", "stiffness", "damping", "damping_ratio"))
        )
        self.candidates = of_sites(("structure",), record.plan)

    def predict(self, system: System) -> Array:
        """Displacement, velocity and acceleration of every storey."""
        if self._whole is not None:
            system = replace(system, plan=self._whole.joined(system.plan))
        rows = replay.building(system, self._ground, *self._inputs)
        return np.column_stack([rows[name] for name in type(self).signals])

    def first(self, ticks: int) -> Building:
        """The whole of it, because it is computed and cheap."""
        return self
