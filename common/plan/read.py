"""Reads and checks a plan: from a TOML file, a text or plain values, with values of the command line in their place."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

from common.errors import PlanError
from common.plan import building, calibration, patience
from common.plan.kinds import TABLES_OF_KIND, check_kind, known_kind, planned
from common.plan.laboratory_tables import RigTable, SlaveLaboratory
from common.plan.plan import INTERFACE, TABLES, Plan
from common.plan.plugins import checked
from common.plan.schema import fill, nearest, plain, without_other_model
from common.plan.tables import OF_CLIENT
from common.plan.toml_file import tables_in, text_of
from common.roles import MASTER, slave_role

# With eight slaves the master works 0.17 ms of a tick of 2 ms (docs/reference/benchmarks.md); sixteen take about a
# sixth of it, and more have not been measured.
MOST_SLAVES = 16
SLAVE_NAME = re.compile(r"[a-z][a-z0-9_]*")
NOMINAL = ("structure", "column", "actuator", "table", "damper", "sensors")
CHOSEN = (
    "structure.rho_infinity",
    "structure.intervals",
    "structure.columns",
    "structure.experimental",
    "column.storey",
    "column.columns_per_storey",
    "column.represents",
)


def load(path: Path) -> Plan:
    """The plan in a TOML file.

    Raises:
        PlanError: the file cannot be read, is no TOML, or holds what no plan can.
    """
    return parse(text_of(path, "plan"), path.parent, str(path))


def parse(text: str, base: Path, name: str = "the plan") -> Plan:
    """The plan in a TOML text; relative paths start from `base`; `name` stands in errors."""
    tables = tables_in(text, name)
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
    if "structure" in given:
        given["structure"] = building.with_modal_damping(given["structure"], tables["structure"])
        building.check_model(given["structure"], tables["structure"])
    if "report" in given:
        given["report"] = calibration.checked(given["report"])
    plan = Plan(base=base, **given)
    plan = replace(plan, slaves={name: slave_laboratory(plan, name, slaves[name]) for name in slaves})
    check_laboratories(plan)
    building.check(plan)
    if plan.ticks < 1:
        raise PlanError(f"duration in [test] is {plan.test.duration} s, shorter than one interval.")
    check_tolerances(plan)
    plan = patience.eased(plan, tables)
    check_safety(plan)
    return plan


def with_test(
    plan: Plan,
    *,
    duration: float | None = None,
    scale: float | None = None,
    seed: int | None = None,
    intervals: int | None = None,
) -> Plan:
    """The plan with command-line values in place of its own, checked like those of a file.

    With `intervals` the building is a client's, whose displacements are each imposed in so many.
    """
    tables = plan.written()
    for table, name, value in (
        ("test", "duration", duration),
        ("ground_motion", "scale", scale),
        ("test", "seed", seed),
        ("structure", "model", OF_CLIENT if intervals is not None else None),
        ("structure", "intervals", intervals),
    ):
        if value is not None:
            tables[table][name] = value
    return replace(from_tables(tables, plan.base), follows_in=plan.follows_in)


def check_laboratories(plan: Plan) -> None:
    """Raise PlanError where a kind is unknown, a rig's keys do not fit, or no process would have a laboratory."""
    for role in (MASTER, "slave"):
        check_kind(getattr(plan, role).kind, role)
        checked(getattr(plan, role).rig, f"{role}.rig")
    if not plan.kinds:
        raise PlanError(
            "Neither [master] nor [slave] has a laboratory: give one of them a kind other than 'none'."
        )


def named_slaves(given: object) -> dict[str, dict[str, Any]]:
    """The slaves that [slave] names, none where it describes the only slave, which has no name.

    Raises:
        PlanError: names and a rig are mixed, a name is not valid, or there are too many.
    """
    if not isinstance(given, dict) or given.keys() <= {"rig", "kind"}:
        return {}
    if "kind" in given:
        tables = ", ".join(f"[slave.NAME.{name}]" for name in given if name in INTERFACE)
        raise PlanError(
            "[slave] gives a kind beside tables, but a slave with tables of its own has a name: write the kind in "
            f"[slave.NAME]{f', and {tables}' * bool(tables)}."
        )
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
            f"[slave] holds a rig beside the slaves {names}: give that rig to a named slave, as [slave.NAME.rig]."
        )
    if len(given) > MOST_SLAVES:
        raise PlanError(f"[slave] names {len(given)} slaves, but there may be at most {MOST_SLAVES}.")
    return given


def slave_laboratory(plan: Plan, name: str, given: dict[str, Any]) -> SlaveLaboratory:
    """The laboratory of a named slave, on top of the plan's own tables."""
    where = f"slave.{name}"
    kind = check_kind(given.get("kind", ""), where)
    known = (*TABLES_OF_KIND[known_kind(planned(slave_role(name), kind))], "rig", "kind")
    for entry in given:
        if entry not in known:
            raise PlanError(f"Unknown key '{entry}' in [{where}]: {nearest(entry, known)}")
    parts: dict[str, Any] = {}
    for part in INTERFACE:
        own, common = given.get(part, {}), getattr(plan, part)
        entries = plain(common)
        merged = without_other_model(common, entries, own) | own if isinstance(own, dict) else own
        parts[part] = fill(type(common), merged, f"{where}.{part}")
    rig = checked(fill(RigTable, given.get("rig", {}), f"{where}.rig"), f"{where}.rig")
    return SlaveLaboratory(rig=rig, kind=kind, **parts)


def check_tolerances(plan: Plan) -> None:
    """Every tolerance must name a nominal parameter and be a share between 0 and 1."""
    tables = plan.tables()
    tables["actuator"] = building.parameters(plan.actuator)
    known = [name for table in NOMINAL for name in uncertain(table, tables[table])]
    chosen = plan.actuator.model
    other = "fopdt" if chosen == "servo_hydraulic" else "servo_hydraulic"
    foreign = uncertain("actuator", building.parameters(replace(plan.actuator, model=other)))
    for name, value in plan.tolerances.parameters.items():
        if name in foreign:
            raise PlanError(
                f"'{name}' in [tolerances] is of the actuator's model '{other}', but '{chosen}' is chosen in "
                "[actuator]: leave it out."
            )
        if name not in known:
            raise PlanError(f"Unknown parameter '{name}' in [tolerances]: {nearest(name, known)}")
        if not 0.0 <= value <= 1.0:
            raise PlanError(f"'{name}' in [tolerances] is {value}, but must be at least 0 and at most 1.")


def uncertain(where: str, table: dict[str, Any]) -> list[str]:
    """The parameters of a table that may have a tolerance: its numbers without those that the plan chooses."""
    names = []
    for key, value in table.items():
        name = f"{where}.{key}"
        if name in CHOSEN:
            continue
        if isinstance(value, dict):
            names += uncertain(name, value)
        elif isinstance(value, int | float | list):
            names.append(name)
    return names


def check_safety(plan: Plan) -> None:
    """Raise PlanError unless a laboratory holds before it ramps."""
    safety = plan.safety
    if safety.hold_after >= safety.ramp_after:
        raise PlanError(
            f"hold_after in [safety] is {safety.hold_after}, but must be below ramp_after, {safety.ramp_after}."
        )
