"""The plan: one TOML file that describes a test, loaded alike by both laboratories."""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import tomli_w

from common.errors import InputError, PlanError
from common.roles import name_of, slave_role
from common.schema import Storeys, fill, key, nearest, plain

PROTOCOL_VERSION = 3
MOST_SLAVES = 16
SLAVE_NAME = re.compile(r"[a-z][a-z0-9_]*")


@dataclass(frozen=True)
class Test:
    """What the test is called, how long it lasts and its control interval."""

    __test__ = False  # not a test case of pytest

    name: str = key(
        "name of the test, part of topics and file names", default="default", pattern="[a-z0-9_-]+"
    )
    duration: float = key("length of the test", default=40.0, unit="s", above=0.0, most=7200.0)
    interval: float = key("control interval", default=0.002, unit="s", least=1e-4, most=0.1)
    seed: int = key("seed of every random draw", default=1, least=0)


@dataclass(frozen=True)
class GroundMotion:
    """The earthquake."""

    record: str = key(
        "name of a shipped record, or path of an AT2, K-NET or CSV file", default="el_centro_1940_ns"
    )
    scale: float = key("factor on the record", default=0.1)


@dataclass(frozen=True)
class NumericalColumns:
    """Force-deformation model of the numerical columns of every storey."""

    model: str = key("name of a specimen model", default="linear")
    parameters: dict[str, float] = key("parameters of that model beside the stiffness", default={}, more=True)


@dataclass(frozen=True)
class Structure:
    """The building: one value per storey, or one for a single storey."""

    mass: Storeys = key("floor masses, from the bottom", default=(160_000.0,), unit="kg", above=0.0)
    stiffness: Storeys = key("storey stiffnesses, all columns", default=(25e6,), unit="N/m", least=0.0)
    damping: Storeys = key("storey dashpots", default=(200_000.0,), unit="N·s/m", least=0.0)
    integrator: str = key("integration method", default="newmark_explicit")
    rho_infinity: float = key("KR-α: spectral radius at infinity", default=0.5, least=0.0, most=1.0)
    columns: NumericalColumns = field(
        default_factory=NumericalColumns, metadata={"table": NumericalColumns, "more": False}
    )


@dataclass(frozen=True)
class Column:
    """The experimental column of laboratory A."""

    model: str = key("name of a specimen model", default="linear")
    stiffness: float = key("elastic stiffness of the specimen", default=12.5e6, unit="N/m", least=0.0)
    storey: int = key("storey in which the specimen stands", default=1, least=1)
    columns_per_storey: int = key("columns of that storey", default=4, least=1)
    represents: int = key("columns of the storey that the specimen stands for", default=1, least=1)
    deformation_ratio: float = key("specimen deformation over storey drift", default=0.5, above=0.0)
    parameters: dict[str, float] = key("parameters of the model beside the stiffness", default={}, more=True)


@dataclass(frozen=True)
class Actuator:
    """Nominal first-order lag with dead time of the hydraulic actuator."""

    gain: float = key("static gain", default=1.0, above=0.0)
    delay: float = key("dead time L", default=0.014, unit="s", least=0.0, most=1.0)
    time_constant: float = key("time constant T, 0 for none", default=0.030, unit="s", least=0.0)


PAPER_COMPENSATOR = {"lead": 0.044, "proportional": 1.93, "integral": 0.047, "derivative": 0.0}


@dataclass(frozen=True)
class ForceCorrection:
    """Phase lead of the measured column force before it enters the equation of motion."""

    cutoff: float = key(
        "corner frequency of the high-pass filter, 0 for none", default=0.0, unit="Hz", least=0.0
    )
    unity: float = key("frequency at which the filter's gain is one", default=2.0, unit="Hz", above=0.0)


@dataclass(frozen=True)
class Compensator:
    """Compensation of the actuator's delay."""

    kind: str = key("name of a compensator", default="pid_taylor")
    parameters: dict[str, float] = key("its parameters", default=PAPER_COMPENSATOR, more=True)
    force: ForceCorrection = field(
        default_factory=ForceCorrection, metadata={"table": ForceCorrection, "more": False}
    )


@dataclass(frozen=True)
class TableCompensator:
    """Compensation of the shaking table, computed by the slave."""

    kind: str = key("name of a compensator", default="none")
    parameters: dict[str, float] = key("its parameters", default={}, more=True)


@dataclass(frozen=True)
class Table:
    """Nominal second-order model with dead time of the shaking table."""

    frequency: float = key(
        "natural frequency, inf for an ideal table", default=15.0, unit="Hz", above=0.0, infinite=True
    )
    damping_ratio: float = key("damping ratio", default=0.7, unit="", above=0.0)
    delay: float = key("dead time", default=0.004, unit="s", least=0.0, most=1.0)
    compensator: TableCompensator = field(
        default_factory=TableCompensator, metadata={"table": TableCompensator, "more": False}
    )


@dataclass(frozen=True)
class Damper:
    """Nominal model of the active mass damper and its scale to the building."""

    mass: float = key("moving mass", default=16.0, unit="kg", above=0.0)
    stiffness: float = key("spring", default=56.8, unit="N/m", least=0.0)
    damping: float = key("dashpot", default=6.0, unit="N·s/m", least=0.0)
    motor_time_constant: float = key("lag of the motor force", default=0.003, unit="s", least=0.0)
    force_scale: float = key(
        "λ: force on the building over force in the laboratory", default=100.0, least=0.0
    )
    floor: int = key("floor on which the damper stands", default=1, least=1)


@dataclass(frozen=True)
class Control:
    """Velocity feedback of the damper."""

    amd: bool = key("whether the building carries the damper", default=True)
    gain: float = key(
        "G: damping force on the building over floor velocity", default=120_000.0, unit="N·s/m", least=0.0
    )


@dataclass(frozen=True)
class Sensors:
    """White noise of each reading, rms."""

    column_displacement: float = key("specimen deformation", default=5e-6, unit="m", least=0.0)
    column_force: float = key("specimen force", default=100.0, unit="N", least=0.0)
    table_displacement: float = key("table displacement", default=10e-6, unit="m", least=0.0)
    table_acceleration: float = key("table acceleration", default=0.01, unit="m/s²", least=0.0)
    damper_stroke: float = key("damper stroke", default=2e-6, unit="m", least=0.0)
    damper_force: float = key("damper force", default=0.2, unit="N", least=0.0)


@dataclass(frozen=True)
class Link:
    """The exchange between the laboratories."""

    connect_timeout: float = key(
        "wait for the other laboratory", default=30.0, unit="s", above=0.0, most=3600.0
    )
    loss_timeout: float = key(
        "silence after which a laboratory is lost", default=1.0, unit="s", above=0.0, most=60.0
    )
    wait_share: float = key(
        "share of the interval a message is waited for", default=0.75, above=0.0, most=0.95
    )


@dataclass(frozen=True)
class Limits:
    """Largest magnitudes; beyond one of them the test is stopped."""

    displacement: float = key("storey displacement", default=0.15, unit="m", above=0.0)
    actuator_command: float = key("actuator command", default=0.05, unit="m", above=0.0)
    column_displacement: float = key("specimen deformation", default=0.03, unit="m", above=0.0)
    column_force: float = key("specimen force", default=400e3, unit="N", above=0.0)
    table_target: float = key("table target", default=0.40, unit="m", above=0.0)
    table_command: float = key("table command", default=0.40, unit="m", above=0.0)
    damper_command: float = key("motor force", default=1000.0, unit="N", above=0.0)
    table_displacement: float = key("table displacement", default=0.40, unit="m", above=0.0)
    table_acceleration: float = key("table acceleration", default=30.0, unit="m/s²", above=0.0)
    damper_stroke: float = key("damper stroke", default=0.40, unit="m", above=0.0)
    damper_force: float = key("damper force", default=1000.0, unit="N", above=0.0)


@dataclass(frozen=True)
class Tolerances:
    """How well each nominal parameter is known, relative."""

    default: float = key("for every parameter not named", default=0.02, least=0.0, most=1.0)
    parameters: dict[str, float] = key('for single ones, as "part.parameter"', default={}, more=True)


@dataclass(frozen=True)
class Rig:
    """The laboratory behind the rig interface."""

    class_: str = key(
        "'file.py:Class' or 'package.module:Class', empty for the emulated laboratory", default=""
    )
    options: dict[str, Any] = key("keyword arguments of the class", default={})


@dataclass(frozen=True)
class Laboratory:
    """Master or slave: what stands in its laboratory."""

    rig: Rig = field(default_factory=Rig, metadata={"table": Rig, "more": False})


@dataclass(frozen=True)
class SlaveLaboratory:
    """One of several slaves: what stands in its laboratory, and its interface to the structure.

    A key that the plan gives in `[slave.NAME.table]`, `.damper` or `.control` holds for this slave; the others are
    those of the plan's own tables. A table's compensator is taken whole.
    """

    table: Table = Table()
    damper: Damper = Damper()
    control: Control = Control()
    rig: Rig = field(default_factory=Rig)


@dataclass(frozen=True)
class Recording:
    """Where recordings go, and whether a test may run without one."""

    folder: str = key("folder of recordings, relative to where the command is started", default="runs")
    required: bool = key("whether the test waits for a recorder and stops without it", default=True)
    patience: float = key(
        "silence of the recorder after which the test stops", default=10.0, unit="s", above=0.0
    )


@dataclass(frozen=True)
class Plan:
    """A test, fully described; `base` is the folder that its relative paths start from.

    `slaves` holds the slaves by name in the order of the file; it is empty where there is one without a name.
    """

    test: Test = Test()
    ground_motion: GroundMotion = GroundMotion()
    structure: Structure = Structure()
    column: Column = Column()
    actuator: Actuator = Actuator()
    compensator: Compensator = Compensator()
    table: Table = Table()
    damper: Damper = Damper()
    control: Control = Control()
    sensors: Sensors = Sensors()
    link: Link = Link()
    limits: Limits = Limits()
    tolerances: Tolerances = Tolerances()
    master: Laboratory = Laboratory()
    slave: Laboratory = Laboratory()
    recording: Recording = Recording()
    slaves: dict[str, SlaveLaboratory] = field(default_factory=dict)
    base: Path = Path()

    @property
    def storeys(self) -> int:
        """Number of storeys."""
        return len(self.structure.mass)

    @property
    def ticks(self) -> int:
        """Number of control intervals of the whole test."""
        return round(self.test.duration / self.test.interval)

    @property
    def roles(self) -> tuple[str, ...]:
        """The role of every slave, in the order of the file."""
        return tuple(map(slave_role, self.slaves or [""]))

    def of(self, role: str) -> Plan:
        """The plan as one slave sees it: its own table, damper, control and rig in the usual places.

        Raises:
            InputError: the plan has no such slave.
        """
        self.slave_role(name_of(role))
        if not self.slaves:
            return self
        lab = self.slaves[name_of(role)]
        parts = {name: getattr(lab, name) for name in INTERFACE}
        return replace(self, slave=Laboratory(lab.rig), slaves={}, **parts)

    def slave_role(self, name: str) -> str:
        """The role of the slave of that name, empty for the one without.

        Raises:
            InputError: the plan has no such slave.
        """
        known = ", ".join(self.slaves)
        if self.slaves and not name:
            raise InputError(f"The plan names its slaves: say which one this is with --name ({known}).")
        if not self.slaves and name:
            raise InputError(f"The plan has one slave without a name: leave out --name {name}.")
        if name and name not in self.slaves:
            raise InputError(f"The plan names no slave '{name}': {nearest(name, self.slaves)}")
        return slave_role(name)

    def everywhere(self, **parts: Any) -> Plan:
        """The plan with a table, damper or control in place of its own and of every slave's."""
        slaves = {name: replace(lab, **parts) for name, lab in self.slaves.items()}
        return replace(self, slaves=slaves, **parts)

    def with_ticks(self, ticks: int) -> Plan:
        """The plan over another number of control intervals."""
        test = replace(self.test, duration=ticks * self.test.interval)
        return replace(self, test=test)

    def tables(self) -> dict[str, Any]:
        """The plan as nested plain values, all defaults written out."""
        tables = {name: plain(getattr(self, name)) for name in TABLES}
        if self.slaves:
            tables["slave"] = {name: plain(lab) for name, lab in self.slaves.items()}
        return tables

    def toml(self) -> str:
        """The plan as TOML text, all defaults written out."""
        return tomli_w.dumps(self.tables())

    def digest(self) -> str:
        """Sixteen hex digits that agree where two plans describe the same test; the recording's folder is free."""
        tables = {name: table for name, table in self.tables().items() if name != "recording"}
        if self.slaves:
            tables["order"] = list(self.slaves)  # their place decides on the order of recorded values
        text = json.dumps(tables, sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()

    def with_test(
        self, *, duration: float | None = None, scale: float | None = None, seed: int | None = None
    ) -> Plan:
        """The plan with command-line values in place of its own, checked like those of a file."""
        tables = self.tables()
        for table, name, value in (
            ("test", "duration", duration),
            ("ground_motion", "scale", scale),
            ("test", "seed", seed),
        ):
            if value is not None:
                tables[table][name] = value
        return from_tables(tables, self.base)


TABLES = tuple(name for name in Plan.__dataclass_fields__ if name not in ("slaves", "base"))
INTERFACE = ("table", "damper", "control")  # what a named slave may have of its own


def load(path: Path) -> Plan:
    """The plan in a TOML file.

    Raises:
        PlanError: the file cannot be read, is no TOML, or holds what no plan can.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise PlanError(f"Cannot read the plan {path}: {reason}; give the path of a TOML file.") from None
    return parse(text, path.parent, str(path))


def parse(text: str, base: Path, name: str = "the plan") -> Plan:
    """The plan in a TOML text; relative paths start from `base`; `name` stands in errors."""
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise PlanError(f"{name} is not valid TOML: {error}.") from None
    try:
        return from_tables(tables, base)
    except PlanError as error:
        raise PlanError(f"{name}: {error}") from None


def from_tables(tables: dict[str, Any], base: Path) -> Plan:
    """The plan of nested plain values."""
    for name in tables:
        if name not in TABLES:
            raise PlanError(f"Unknown table [{name}]: {nearest(name, TABLES)}")
    types = {name: type(getattr(Plan, name)) for name in TABLES}
    slaves = named_slaves(tables.get("slave", {}))
    given = {name: fill(types[name], tables[name], name) for name in tables if name != "slave" or not slaves}
    plan = Plan(base=base, **given)
    plan = replace(plan, slaves={name: slave_laboratory(plan, name, slaves[name]) for name in slaves})
    check_storeys(plan)
    check_columns(plan)
    check_tolerances(plan)
    return plan


def named_slaves(given: object) -> dict[str, dict[str, Any]]:
    """The slaves that [slave] names, none where it holds the rig of the only one.

    Raises:
        PlanError: names and a rig are mixed, a name is none, or there are too many.
    """
    if not isinstance(given, dict) or given.keys() <= {"rig"}:
        return {}
    for name, table in given.items():
        if not isinstance(table, dict):
            raise PlanError(
                f"{name} in [slave] is {table!r}: give [slave.rig], or tables [slave.NAME.rig] for several slaves."
            )
        if not SLAVE_NAME.fullmatch(name):
            raise PlanError(
                f"The slave's name '{name}' in [slave.{name}] must begin with a letter and have "
                "small letters, digits and _ only."
            )
    if "rig" in given:
        names = ", ".join(name for name in given if name != "rig")
        raise PlanError(
            f"[slave] holds a rig beside the slaves {names}: name that one too, as [slave.NAME.rig]."
        )
    if len(given) > MOST_SLAVES:
        raise PlanError(f"[slave] names {len(given)} slaves, but there may be at most {MOST_SLAVES}.")
    return given


def slave_laboratory(plan: Plan, name: str, given: dict[str, Any]) -> SlaveLaboratory:
    """The laboratory of a named slave, on top of the plan's own tables."""
    where = f"slave.{name}"
    known = (*INTERFACE, "rig")
    for entry in given:
        if entry not in known:
            raise PlanError(f"Unknown key '{entry}' in [{where}]: {nearest(entry, known)}")
    parts: dict[str, Any] = {}
    for part in INTERFACE:
        own, common = given.get(part, {}), getattr(plan, part)
        merged = plain(common) | own if isinstance(own, dict) else own
        parts[part] = fill(type(common), merged, f"{where}.{part}")
    return SlaveLaboratory(rig=fill(Rig, given.get("rig", {}), f"{where}.rig"), **parts)


def check_storeys(plan: Plan) -> None:
    """Masses, stiffnesses, dashpots, the specimen's storey and the dampers' floors must fit together."""
    structure, storeys = plan.structure, plan.storeys
    for name, values in (("stiffness", structure.stiffness), ("damping", structure.damping)):
        if len(values) != storeys:
            raise PlanError(
                f"[structure] has {storeys} masses but {len(values)} values of {name}: give one per storey."
            )
    if plan.column.storey > storeys:
        raise PlanError(f"storey in [column] is {plan.column.storey}, but the structure has {storeys}.")
    dampers = {f"slave.{name}.damper": lab.damper for name, lab in plan.slaves.items()}
    for where, damper in (dampers or {"damper": plan.damper}).items():
        if damper.floor > storeys:
            raise PlanError(f"floor in [{where}] is {damper.floor}, but the structure has {storeys}.")


def check_columns(plan: Plan) -> None:
    """The specimen cannot stand for more columns than its storey has, nor a test last less than one interval."""
    column = plan.column
    if column.represents > column.columns_per_storey:
        raise PlanError(
            f"represents in [column] is {column.represents}, but the storey has {column.columns_per_storey} columns."
        )
    if plan.ticks < 1:
        raise PlanError(f"duration in [test] is {plan.test.duration} s, shorter than one interval.")


def check_tolerances(plan: Plan) -> None:
    """Every tolerance must name a nominal parameter and be a share between 0 and 1."""
    for name, value in plan.tolerances.parameters.items():
        part, _, parameter = name.partition(".")
        tables = plan.tables()
        known = [f"{table}.{item}" for table in NOMINAL for item in tables[table]]
        if f"{part}.{parameter}" not in known:
            raise PlanError(f"Unknown parameter '{name}' in [tolerances]: {nearest(name, known)}")
        if not 0.0 <= value <= 1.0:
            raise PlanError(f"'{name}' in [tolerances] is {value}, but must be at least 0 and at most 1.")


NOMINAL = ("structure", "column", "actuator", "table", "damper", "sensors")


def resolve(plan: Plan, path: str) -> Path:
    """A path of the plan, relative to the plan's own folder."""
    return plan.base / path


def safe_name(text: str) -> str:
    """`text` as part of a file name."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "-", text)


def ideal(plan: Plan) -> Plan:
    """The plan with transfer systems that follow at once, and no compensation."""
    return replace(
        plan.everywhere(table=Table(frequency=float("inf"), damping_ratio=1.0, delay=0.0)),
        actuator=Actuator(gain=1.0, delay=0.0, time_constant=0.0),
        compensator=Compensator(kind="none", parameters={}),
    )
