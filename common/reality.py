"""The reality: what the laboratories really do where it is not what the plan says.

It is given to the laboratories only. Nothing of it, its name included, reaches a recording, a log or a
report.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from common.errors import PlanError
from common.plan import Plan, Rig, from_tables
from common.schema import fill, nearest

Entry = tuple[str, Mapping[str, float]]  # name of an effect of the catalogue, and its parameters

TRUE_TABLES = ("ground_motion", "structure", "column", "actuator", "table", "damper", "sensors")
KNOWN = ("seed", "master", "slave", "link", "effect", *TRUE_TABLES)


@dataclass(frozen=True)
class Reality:
    """What differs from the plan; the plan itself where nothing does."""

    plan: Plan  # with the true parameters in place of the nominal ones
    seed: int
    master: Rig
    slave: Rig
    link: Rig = field(default_factory=Rig)
    base: Path = Path()
    hidden: frozenset[str] = frozenset()  # laboratories whose rig no recording may name
    effects: tuple[Entry, ...] = ()  # laid over the emulated laboratories, in this order


def as_planned(plan: Plan) -> Reality:
    """The laboratories are what the plan says."""
    return Reality(plan, plan.test.seed, plan.master.rig, plan.slave.rig, base=plan.base)


def load(path: Path, plan: Plan) -> Reality:
    """The reality in a TOML file, on top of a plan.

    Raises:
        PlanError: the file cannot be read, is no TOML, or holds what no reality can.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise PlanError(f"Cannot read the reality {path}: {error.strerror}.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise PlanError(f"The reality {path} is not valid TOML: {error}.") from None
    try:
        return from_reality(tables, plan, path.parent)
    except PlanError as error:
        raise PlanError(f"The reality {path}: {error}") from None


def from_reality(tables: dict[str, Any], plan: Plan, base: Path) -> Reality:
    """The reality of nested plain values; paths of plug-ins start from `base`."""
    for name in tables:
        if name not in KNOWN:
            raise PlanError(f"Unknown entry '{name}': {nearest(name, KNOWN)}")
    seed = tables.get("seed", plan.test.seed)
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        raise PlanError(f"seed is {seed!r}, but must be a whole number of at least 0.")
    return Reality(
        plan=true_plan(tables, plan),
        seed=seed,
        master=rig(tables, "master", plan.master.rig, plan.base, base),
        slave=rig(tables, "slave", plan.slave.rig, plan.base, base),
        link=rig({"link": {"rig": tables.get("link", {})}}, "link", Rig(), plan.base, base),
        base=base,
        hidden=frozenset(lab for lab in ("master", "slave") if "rig" in tables.get(lab, {})),
        effects=entries(tables.get("effect", [])),
    )


def entries(given: object) -> tuple[Entry, ...]:
    """The effects of `[[effect]]` tables: a name and numbers; whether the catalogue knows them is seen later."""
    if not isinstance(given, list) or not all(isinstance(entry, dict) for entry in given):
        raise PlanError("effects are given as [[effect]] tables with a name and parameters.")
    result = []
    for entry in given:
        name = entry.get("name")
        if not isinstance(name, str):
            raise PlanError(f"an [[effect]] has the name {name!r}: give a name of the catalogue.")
        values = {key: value for key, value in entry.items() if key != "name"}
        for key, value in values.items():
            if not isinstance(value, int | float) or isinstance(value, bool):
                raise PlanError(f"{key} of [[effect]] '{name}' is {value!r}, but must be a number.")
        result.append((name, {key: float(value) for key, value in values.items()}))
    return tuple(result)


def true_plan(tables: dict[str, Any], plan: Plan) -> Plan:
    """The plan with the reality's parameters in place of its own."""
    merged = plan.tables()
    for name in TRUE_TABLES:
        merged[name] |= tables.get(name, {})
    return from_tables(merged, plan.base)


def rig(tables: dict[str, Any], lab: str, planned: Rig, plan_base: Path, base: Path) -> Rig:
    """The rig of a laboratory, with the path of its class made absolute."""
    entry = tables.get(lab, {})
    chosen, start = (planned, plan_base)
    if "rig" in entry:
        chosen, start = fill(Rig, entry["rig"], f"{lab}.rig"), base
    if ".py:" in chosen.class_:
        return Rig(class_=str(start.resolve() / chosen.class_), options=chosen.options)
    return chosen
