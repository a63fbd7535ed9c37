"""The plan: one TOML file that describes a test, which every process of the test loads."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import tomli_w

from common.errors import InputError
from common.plan.kinds import NONE, TABLES_OF_KIND, known_kind, planned
from common.plan.laboratory_tables import (
    Actuator,
    Column,
    CompensatorTable,
    Control,
    Damper,
    DeviceTable,
    LaboratoryTable,
    ShakingTable,
    SlaveLaboratory,
)
from common.plan.schema import nearest, plain
from common.plan.tables import (
    OF_CLIENT,
    OF_PLAN,
    GroundMotionTable,
    Limits,
    Link,
    Preflight,
    RecordingTable,
    ReportTable,
    SafetyTable,
    SensorsTable,
    Structure,
    Test,
    Tolerances,
)
from common.roles import MASTER, name_of, slave_role

PROTOCOL_VERSION = 7
OVERRUN = "safety.overrun"
FOLLOWS_IN = "table.compensator"


@dataclass(frozen=True)
class Plan:
    """The full description of a test; `base` is the folder from which its relative paths start.

    `slaves` holds the slaves by name in the order of the file; it is empty where there is one slave without a name.
    `follows_in` is the table of the file that the table's compensator comes from, for messages about it.
    `eased` names the figures that the file does not set and that are eased because all laboratories are emulated
    (common/plan/patience.py).
    """

    test: Test = Test()
    ground_motion: GroundMotionTable = GroundMotionTable()
    structure: Structure = Structure()
    column: Column = Column()
    actuator: Actuator = Actuator()
    compensator: CompensatorTable = CompensatorTable()
    table: ShakingTable = ShakingTable()
    damper: Damper = Damper()
    control: Control = Control()
    device: DeviceTable = DeviceTable()
    sensors: SensorsTable = SensorsTable()
    link: Link = Link()
    safety: SafetyTable = SafetyTable()
    preflight: Preflight = Preflight()
    limits: Limits = Limits()
    tolerances: Tolerances = Tolerances()
    master: LaboratoryTable = LaboratoryTable()
    slave: LaboratoryTable = LaboratoryTable()
    recording: RecordingTable = RecordingTable()
    report: ReportTable = ReportTable()
    slaves: dict[str, SlaveLaboratory] = field(default_factory=dict)
    base: Path = Path()
    follows_in: str = field(default=FOLLOWS_IN, compare=False)
    eased: tuple[str, ...] = field(default=(), compare=False)

    @property
    def emulated(self) -> bool:
        """Whether no laboratory of the plan has a rig of the user's."""
        rigs = [self.master.rig, self.slave.rig, *(lab.rig for lab in self.slaves.values())]
        return not any(rig.own for rig in rigs)

    @property
    def makes_good(self) -> bool:
        """Whether late ticks are caught up: for emulated rigs time passes by ticks only."""
        return OVERRUN in self.eased

    @property
    def served(self) -> bool:
        """Whether the building is a client's, which asks for displacements and is answered with forces."""
        return self.structure.model == OF_CLIENT

    @property
    def foreign(self) -> bool:
        """Whether the building is a model that a program beside the master computes."""
        return self.structure.model not in (OF_PLAN, OF_CLIENT)

    @property
    def by_tables(self) -> Plan:
        """The plan with the linear building of [structure] in place of a model that another program computes."""
        if not self.foreign:
            return self
        return replace(self, structure=replace(self.structure, model=OF_PLAN, options={}))

    @property
    def storeys(self) -> int:
        """Number of storeys."""
        return len(self.structure.mass)

    @property
    def ticks(self) -> int:
        """Number of control intervals of the whole test."""
        return round(self.test.duration / self.test.interval)

    def tick_ns(self, tick: int) -> int:
        """Nominal time of a tick after the first, ns; each is rounded by itself, so that errors do not accumulate."""
        return round(tick * (self.test.interval * 1e9))

    @property
    def window(self) -> int:
        """The number of intervals by which a fresh message may be late or ahead."""
        return max(round(self.safety.message_age / self.test.interval), 1)

    @cached_property
    def roles(self) -> tuple[str, ...]:
        """The role of every slave, in the order of the file."""
        if not self.slaves and self.slave.kind == NONE:
            return ()
        return tuple(map(slave_role, self.slaves or [""]))

    @cached_property
    def kinds(self) -> Mapping[str, str]:
        """The kind of laboratory of each role that has one, the master's first: a name, or a class of the user's."""
        slaves = {slave_role(name): lab.kind for name, lab in self.slaves.items()}
        slaves = slaves or dict.fromkeys(self.roles, self.slave.kind)
        given = {MASTER: self.master.kind} | slaves
        return {role: kind for role, text in given.items() if (kind := planned(role, text)) != NONE}

    def of(self, role: str) -> Plan:
        """The plan as the master or one slave sees it: the tables of its laboratory replace the plan's common ones.

        Raises:
            InputError: the plan has no such slave.
        """
        if role == MASTER:
            return self
        self.slave_role(name_of(role))
        if not self.slaves:
            return self
        lab = self.slaves[name_of(role)]
        parts = {name: getattr(lab, name) for name in INTERFACE}
        own = lab.table.compensator != self.table.compensator
        follows_in = f"{role}.{FOLLOWS_IN}" if own else FOLLOWS_IN
        return replace(
            self, slave=LaboratoryTable(lab.rig, lab.kind), slaves={}, follows_in=follows_in, **parts
        )

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
        """The plan with another number of control intervals."""
        test = replace(self.test, duration=ticks * self.test.interval)
        return replace(self, test=test)

    def tables(self) -> dict[str, Any]:
        """The plan as nested plain values, all defaults written out."""
        tables = {name: plain(getattr(self, name)) for name in TABLES}
        if self.slaves:
            tables["slave"] = {name: self.tables_of(name) for name in self.slaves}
        for lab in (tables["master"], tables["slave"]):
            if lab.get("kind") == "":
                del lab["kind"]
        if self.device == DeviceTable():
            del tables["device"]
        if self.report == ReportTable():
            del tables["report"]
        for name in unsaid(self):
            del tables["structure"][name]
        return tables

    def tables_of(self, name: str) -> dict[str, Any]:
        """The tables of a named slave that its kind of laboratory takes, and its kind where the plan gives it."""
        lab = plain(self.slaves[name])
        wanted = (*TABLES_OF_KIND[known_kind(planned(slave_role(name), lab["kind"]))], "rig")
        return {part: lab[part] for part in (*(["kind"] if lab["kind"] else []), *wanted)}

    def written(self) -> dict[str, Any]:
        """As `tables`, without the eased figures, so that a plan to which a rig is added has the strict ones."""
        tables = self.tables()
        for name in self.eased:
            table, _, key = name.partition(".")
            del tables[table][key]
        return tables

    def toml(self) -> str:
        """The plan as TOML text, with all defaults but those that hold for emulated laboratories only."""
        return tomli_w.dumps(self.written())

    def digest(self) -> str:
        """Sixteen hex digits, equal for two plans that describe the same test, whatever is recorded and reported."""
        tables = {name: table for name, table in self.tables().items() if name not in UNTESTED}
        if self.slaves:
            tables["order"] = list(self.slaves)  # recorded values per slave stand in this order
        text = json.dumps(tables, sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


UNTESTED = ("recording", "report")  # tables that do not describe the test


def unsaid(plan: Plan) -> tuple[str, ...]:
    """The keys of [structure] that do not apply to what computes the building."""
    if plan.foreign:
        return ("intervals",)
    return ("options",) if plan.served else ("model", "options", "intervals")


BESIDE = ("slaves", "base", "follows_in", "eased")  # fields that are not tables of a file
TABLES = tuple(name for name in Plan.__dataclass_fields__ if name not in BESIDE)
INTERFACE = tuple(dict.fromkeys(name for names in TABLES_OF_KIND.values() for name in names))
"""The tables that a named slave of any kind may have of its own."""


def resolve(plan: Plan, path: str) -> Path:
    """A path of the plan, relative to the plan's own folder."""
    return plan.base / path


def ideal(plan: Plan) -> Plan:
    """The plan with transfer systems that follow their command at once, and without compensation.

    `[compensator.force]` is left out too, with its unit delay, and the actuator's command is a ramp even where the plan
    holds it. The ramp brings the specimen to its target at the interval's end at the interval's mean velocity, so the
    force of its dashpot is half an interval late, that of its mass a whole one, and that of its spring is not late.
    Tolerances of servo-hydraulics are left out, because the ideal actuator has none of their parameters.
    """
    kept = {
        name: value
        for name, value in plan.tolerances.parameters.items()
        if not name.startswith("actuator.servo.")
    }
    return replace(
        plan.everywhere(table=ShakingTable(frequency=float("inf"), damping_ratio=1.0, delay=0.0)),
        actuator=Actuator(gain=1.0, delay=0.0, time_constant=0.0),
        compensator=CompensatorTable(kind="none", parameters={}),
        tolerances=replace(plan.tolerances, parameters=kept),
    )
