"""The figures of `rths check` for a plan of a machine by itself, of which there is no building to describe."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from datetime import date
from pathlib import Path
from typing import Any

from common.plan.calibration import overdue
from common.plan.kinds import OWN, TABLES_OF_KIND, known_kind
from common.plan.plan import Plan
from common.plan.schema import plain, table_fields
from laboratories.kinds import kinds_of
from models.specimens import SPECIMENS
from report.plan import classes, slips
from report.plan.named_test import of_test

# Tables of a test, without which a plan has those of the default test.
BUILDING = ("structure", "ground_motion")


def by_itself(plan: Plan, stated: Collection[str]) -> bool:
    """Whether a plan that states these tables is of one machine: the other laboratory is off, and there is no building.

    A rig of the user's is there for a test. So is a plan that says nothing of its machine.
    """
    if len(plan.kinds) != 1 or not plan.emulated or set(BUILDING) & {*stated}:
        return False
    kind = known_kind(next(iter(plan.kinds.values())))
    return kind == OWN or bool({*TABLES_OF_KIND[kind]} & {*stated})


def facts(plan: Plan, file: Path, given: Mapping[str, Any]) -> dict[str, Any]:
    """What a plan of a machine by itself describes; `given` holds the tables of its file.

    The figures of a test are none.

    Raises:
        RthsError: a class of the user's that is its laboratory cannot be used.
    """
    kinds_of(plan)
    kind = known_kind(next(iter(plan.kinds.values())))
    tables = [name for name in (*TABLES_OF_KIND[kind], "sensors") if name in given]
    return {
        **of_test(plan, file),
        "machine": {name: stated(getattr(plan, name), given[name]) for name in tables},
        "ground_motion": None,
        "structure": None,
        "transfer_systems": {},
        "delay": None,
        "stable": None,
        "peaks": {},
        "recording": None,
        "classes": [one._asdict() for one in classes.named(plan)],
        "rigs": [],
        "calibration": list(overdue(plan, date.today())),
        "slips": [one._asdict() for one in slips.of_machine(plan)],
        "refused": [],
        "ready": True,
    }


def stated(table: Any, given: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The values that a file gives of a table, in SI units, with these; those of a table within it by `TABLE.key`."""
    units = {
        field.name.rstrip("_"): field.metadata["rule"].unit
        for field in table_fields(table)
        if "rule" in field.metadata and not field.metadata.get("more")
    }
    if (law := SPECIMENS.get(getattr(table, "model", ""))) is not None:
        units |= {name: rule.unit for name, rule in law.rules.items()}
    found: dict[str, dict[str, Any]] = {}
    for name, value in plain(table).items():
        if name not in given:
            continue
        if isinstance(value, dict):
            within = stated(getattr(table, name), given[name])
            found |= {f"{name}.{key}": one for key, one in within.items()}
        else:
            found[name] = {"value": value, "unit": units.get(name, "")}
    return found
