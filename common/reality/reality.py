"""The reality: how the laboratories differ from the plan.

It is given to the laboratories only. No part of it, including its name, reaches a recording, a log or a report.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from common.errors import PlanError
from common.plan.building import OF_FOPDT
from common.plan.kinds import TABLES_OF_KIND, known_kind
from common.plan.laboratory_tables import Column, RigTable
from common.plan.plan import Plan
from common.plan.plugins import checked
from common.plan.read import from_tables
from common.plan.schema import fill, nearest, without_other_model
from common.plan.toml_file import load_tables
from common.reality.found import LearnedEntry, check_found, learned
from common.roles import MASTER, SLAVE, slave_role

Entry = tuple[str, Mapping[str, float]]  # name of an effect of the catalogue, and its parameters

TRUE_TABLES = ("ground_motion", "structure", "column", "actuator", "table", "damper", "device", "sensors")
OF_LABORATORY = ("actuator", "column", "table", "damper", "device")  # true tables that a named slave may have
# Keys of [device] that are choices of the plan, so that reality cannot differ in them.
DESIGNED = ("place", "ratio", "scale", "compensator", "limits")
MERGED = (
    "experimental",
    "servo",
    "parameters",
    "noise",
)  # inner tables that keep the keys that a reality does not give
KNOWN = ("seed", "master", "slave", "link", "effect", "found", "learned", *TRUE_TABLES)


@dataclass(frozen=True)
class Reality:
    """The true parameters, rigs and effects of a test.

    For a reality of one role alone, `role` and `place` (its index among the slaves) name the role, and `whole` is the
    reality of the whole test.
    """

    plan: Plan  # with the true parameters in place of the nominal ones
    seed: int
    master: RigTable
    slave: RigTable
    link: RigTable = field(default_factory=RigTable)
    base: Path = Path()
    hidden: frozenset[str] = frozenset()  # roles whose rig must not be named in a recording
    effects: tuple[Entry, ...] = ()  # applied to the emulated laboratories in this order
    only: tuple[
        str, ...
    ] = ()  # for each effect the one role to whose laboratory it is applied, empty for all
    learned: tuple[LearnedEntry, ...] = ()  # laws that a diagnosis learned of what no effect explains
    slaves: dict[str, RigTable] = field(default_factory=dict)  # by role, where the plan names them
    role: str = SLAVE
    place: int = 0
    whole: Reality | None = None

    def of(self, role: str) -> Reality:
        """The reality of the master's or of one slave's laboratory; raises InputError where there is no such slave."""
        plan = self.plan.of(role)
        pairs = zip(self.effects, self.only, strict=True)
        kept = [(entry, alone) for entry, alone in pairs if alone in ("", role)]
        return replace(
            self,
            plan=plan,
            slave=self.slaves.get(role, self.slave),
            slaves=self.slaves if role == MASTER else {},
            effects=tuple(entry for entry, _ in kept),
            only=tuple(alone for _, alone in kept),
            learned=tuple(entry for entry in self.learned if entry.role == role),
            role=role,
            place=list(self.slaves).index(role) if role in self.slaves else 0,
            whole=self.whole or self,
        )


def as_planned(plan: Plan) -> Reality:
    """The reality in which all laboratories are as planned."""
    slaves = {slave_role(name): placed(lab.rig, plan.base) for name, lab in plan.slaves.items()}
    master, slave = (placed(lab.rig, plan.base) for lab in (plan.master, plan.slave))
    return Reality(plan, plan.test.seed, master, slave, base=plan.base, slaves=slaves)


def load(path: Path, plan: Plan) -> Reality:
    """The reality in a TOML file, on top of a plan.

    Raises:
        PlanError: the file cannot be read, is no TOML, or holds what no reality can.
    """
    tables = load_tables(path, "reality")
    try:
        return from_reality(tables, plan, path.parent)
    except PlanError as error:
        raise PlanError(f"The reality {path}: {error}") from None


def from_reality(tables: dict[str, Any], plan: Plan, base: Path) -> Reality:
    """The reality of nested plain values; paths of plug-ins start from `base`."""
    for name in tables:
        if name not in KNOWN:
            raise PlanError(f"Unknown entry '{name}': {nearest(name, KNOWN)}")
    check_found(tables, plan)
    seed = tables.get("seed", plan.test.seed)
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        raise PlanError(f"seed is {seed!r}, but must be a whole number of at least 0.")
    labs = laboratories(tables, plan)
    planned = {MASTER: plan.master.rig} | {role: plan.of(role).slave.rig for role in plan.roles}
    rigs = {role: rig(labs[role], role, planned[role], plan.base, base) for role in planned}
    effects = tables.get("effect", [])
    return Reality(
        plan=true_plan(tables, plan),
        seed=seed,
        master=rigs.pop(MASTER),
        slave=rigs.get(SLAVE, RigTable()),
        link=rig({"rig": tables.get("link", {})}, "link", RigTable(), plan.base, base),
        base=base,
        hidden=frozenset(role for role, lab in labs.items() if "rig" in lab),
        effects=entries(effects),
        only=tuple(alone(entry, plan) for entry in effects),
        learned=learned(tables, plan, base),
        slaves=rigs if plan.slaves else {},
    )


def laboratories(tables: dict[str, Any], plan: Plan) -> dict[str, dict[str, Any]]:
    """The tables of a reality for the master and the slaves, by role.

    Raises:
        PlanError: one of them is not a table, or names a slave that the plan does not have.
    """
    slaves = tables.get("slave", {})
    if plan.slaves and isinstance(slaves, dict):
        for name in slaves:
            if name not in plan.slaves:
                raise PlanError(f"The plan names no slave '{name}': {nearest(name, plan.slaves)}")
        slaves = {slave_role(name): slaves.get(name, {}) for name in plan.slaves}
    else:
        slaves = {SLAVE: slaves}
    labs = {MASTER: tables.get("master", {})} | slaves
    for role, lab in labs.items():
        known = tables_of(plan, role) if role in slaves and plan.slaves else ("rig",)
        if not isinstance(lab, dict):
            raise PlanError(f"[{role}] must be a table, not {lab!r}.")
        for name in lab:
            if name not in known:
                hint = nearest(name, known)
                if name in OF_LABORATORY and role == SLAVE:
                    hint = (
                        f"a slave without a name has [{name}] itself; name it in the plan for one of its own."
                    )
                raise PlanError(f"Unknown key '{name}' in [{role}]: {hint}")
    return labs


def tables_of(plan: Plan, role: str) -> tuple[str, ...]:
    """The tables that a reality may give for a named slave: its rig, and those that its kind of laboratory takes."""
    taken = TABLES_OF_KIND[known_kind(plan.kinds[role])]
    return ("rig", *(name for name in OF_LABORATORY if name in taken))


def alone(entry: Mapping[str, Any], plan: Plan) -> str:
    """The role that an effect names by `slave` or `laboratory`, empty where it applies to all.

    Raises:
        PlanError: the plan has no such laboratory, or both are given.
    """
    name, lab = entry.get("slave", ""), entry.get("laboratory", "")
    if name and lab:
        raise PlanError(f"[[effect]] '{entry['name']}' gives both slave and laboratory: leave slave out.")
    if lab:
        if lab not in (MASTER, *plan.roles):
            raise PlanError(
                f"laboratory of [[effect]] '{entry['name']}' is {lab!r}, which the plan does not have: "
                f"{nearest(str(lab), (MASTER, *plan.roles))}"
            )
        return str(lab)
    if name == "":
        return ""
    if not isinstance(name, str) or name not in plan.slaves:
        hint = nearest(str(name), plan.slaves) if plan.slaves else "leave slave out."
        raise PlanError(
            f"slave of [[effect]] '{entry['name']}' is {name!r}, which the plan does not name: {hint}"
        )
    return slave_role(name)


def entries(given: object) -> tuple[Entry, ...]:
    """The effects of `[[effect]]` tables: a name and numbers, which are not compared with the catalogue here."""
    if not isinstance(given, list) or not all(isinstance(entry, dict) for entry in given):
        raise PlanError("effects are given as [[effect]] tables with a name and parameters.")
    result = []
    for entry in given:
        name = entry.get("name")
        if not isinstance(name, str):
            raise PlanError(f"an [[effect]] has the name {name!r}: give a name of the catalogue.")
        values = {key: value for key, value in entry.items() if key not in ("name", "slave", "laboratory")}
        for key, value in values.items():
            if not isinstance(value, int | float) or isinstance(value, bool):
                raise PlanError(f"{key} of [[effect]] '{name}' is {value!r}, but must be a number.")
        result.append((name, {key: float(value) for key, value in values.items()}))
    return tuple(result)


def true_plan(tables: dict[str, Any], plan: Plan) -> Plan:
    """The plan with the reality's parameters in place of its own.

    A table of one slave comes after the one for all slaves. The tolerances stay the plan's, because they belong to its
    nominal parameters.
    """
    merged = plan.tables()
    del merged["tolerances"]
    check_device(tables, "device")
    check_building(tables, plan)
    for name in TRUE_TABLES:
        given = table_of(tables, name, name)
        if given:
            merged[name] = true_table(name, merged.get(name, {}), given)
    for slave in plan.slaves:
        lab, own = merged["slave"][slave], tables.get("slave", {}).get(slave, {})
        check_device(own, f"slave.{slave}.device")
        for name in OF_LABORATORY:
            if name in lab:
                lab[name] = true_table(name, lab[name], table_of(tables, name, name))
                lab[name] = true_table(name, lab[name], table_of(own, name, f"slave.{slave}.{name}"))
    return replace(from_tables(merged, plan.base), tolerances=plan.tolerances)


def true_table(name: str, planned: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """A planned table with the values that a reality gives for it."""
    kept = replaced(name, planned, given)
    return kept | within(kept, given)


def check_building(tables: Mapping[str, Any], plan: Plan) -> None:
    """Raise PlanError where [structure] gives another key than the options of a model that a program computes."""
    for key in table_of(tables, "structure", "structure") if plan.foreign else ():
        if key != "options":
            raise PlanError(
                f"{key} in [structure] says nothing of '{plan.structure.model}', which computes the building: give "
                "its options, or leave it out."
            )


def check_device(tables: Mapping[str, Any], where: str) -> None:
    """Raise PlanError where [device] gives a key that the plan chooses, so that reality cannot differ in it."""
    for key in table_of(tables, "device", where):
        if key in DESIGNED:
            raise PlanError(
                f"{key} in [{where}] is chosen by the plan and cannot be different in reality: leave it out."
            )


def replaced(name: str, planned: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """The keys of a planned table that stay beside the values that a reality gives.

    Where the reality has another model of actuator or specimen, the parameters of the planned model go. Dashpots
    replace a damping ratio, and a damping ratio replaces dashpots.
    """
    if name == "column":
        return without_other_model(Column, planned, given)
    gone: tuple[str, ...] = ()
    if name == "actuator" and given.get("model", planned.get("model")) != planned.get("model"):
        gone = (*OF_FOPDT, "servo")
    if name == "structure" and "damping" in given and "damping_ratio" not in given:
        gone = ("damping_ratio",)
    if name == "structure" and given.get("damping_ratio", 0.0) != 0.0 and "damping" not in given:
        gone = ("damping",)
    return {key: value for key, value in planned.items() if key not in gone}


def within(planned: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """The values that a reality gives for one table; inner tables in `MERGED` keep the planned keys not given."""
    return {
        name: planned[name] | value
        if name in MERGED and isinstance(value, dict) and name in planned
        else value
        for name, value in given.items()
    }


def table_of(tables: Mapping[str, Any], name: str, where: str) -> dict[str, Any]:
    """One table of several, empty where it is not given; raises PlanError if it is not a table."""
    table = tables.get(name, {})
    if not isinstance(table, dict):
        raise PlanError(f"[{where}] must be a table, not {table!r}.")
    return table


def rig(entry: dict[str, Any], lab: str, planned: RigTable, plan_base: Path, base: Path) -> RigTable:
    """The rig of a laboratory from a reality, or else as planned, with absolute paths of class and option `file`."""
    chosen, start = (planned, plan_base)
    if "rig" in entry:
        chosen, start = checked(fill(RigTable, entry["rig"], f"{lab}.rig"), f"{lab}.rig"), base
    found = placed(chosen, start)
    return replace(found, class_=str(start.resolve() / chosen.class_)) if ".py:" in chosen.class_ else found


def placed(rig: RigTable, start: Path) -> RigTable:
    """A rig whose option `file`, where it has one, is a path from the folder `start`."""
    file = rig.options.get("file")
    if not isinstance(file, str):
        return rig
    return replace(rig, options=rig.options | {"file": str(start.resolve() / file)})
