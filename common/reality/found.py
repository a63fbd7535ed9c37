"""The entries of a reality that a diagnosis wrote: which plan it belongs to, and the laws learned from a recording."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import BadZipFile

import numpy as np

from common.errors import PlanError
from common.plan.plan import Plan
from common.roles import MASTER

# Tables of a plan that describe the laboratories: findings are valid for a plan with the same nominal models.
OF_MODELS = ("column", "actuator", "table", "damper", "device", "master", "slave")
BUILDING = "structure"  # the plan's table of the building, and the site in the names of effects on it
CHOSEN = "compensator"  # key of a laboratory's table that does not belong to its nominal model


class LearnedEntry(NamedTuple):
    """A law of `models.preisach` that a machine of one laboratory follows beside its model."""

    role: str
    machine: str  # `actuator`, `column`, `table` or `damper`: part of `models.system.Effects` with a field `learned`
    law: tuple[float, ...]


def models_of(plan: Plan) -> str:
    """Sixteen hex digits that are equal if two plans have the same nominal laboratories.

    Building, ground motion, compensators and control may differ.
    """
    tables = plan.tables()
    return digest({name: without_choices(tables.get(name)) for name in OF_MODELS})


def building_of(plan: Plan) -> str:
    """Sixteen hex digits that are equal if two plans have the same building."""
    return digest(plan.tables()[BUILDING])


def digest(plain: Any) -> str:
    """Sixteen hex digits of plain values."""
    text = json.dumps(plain, sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


def without_choices(plain: Any) -> Any:
    """Nested plain values without compensators."""
    if not isinstance(plain, dict):
        return plain
    return {name: without_choices(value) for name, value in plain.items() if name != CHOSEN}


def of_building(tables: Mapping[str, Any]) -> list[str]:
    """The entries of a reality that concern the building: its table, and effects on it."""
    effects = tables.get("effect", [])
    names = (
        [str(one.get("name")) for one in effects if isinstance(one, dict)]
        if isinstance(effects, list)
        else []
    )
    found = [name for name in names if name.partition(".")[0] == BUILDING]
    return [*([f"[{BUILDING}]"] if tables.get(BUILDING) else []), *found]


def for_another_building(tables: Mapping[str, Any], plan: Plan) -> tuple[dict[str, Any], list[str]]:
    """The tables of a reality for a plan, and the entries left out because they belong to another building."""
    found = tables.get("found", {})
    if not isinstance(found, dict) or found.get("building", building_of(plan)) == building_of(plan):
        return dict(tables), []
    gone = of_building(tables)
    kept = {name: value for name, value in tables.items() if name != BUILDING}
    if "effect" in kept:
        kept["effect"] = [one for one in kept["effect"] if one.get("name") not in gone]
    return kept, gone


def check_found(tables: Mapping[str, Any], plan: Plan) -> None:
    """Raise PlanError if a reality belongs to other nominal models, or to another building, than the plan's."""
    given = tables.get("found", {})
    if not isinstance(given, dict):
        raise PlanError(f"[found] must be a table, not {given!r}.")
    models = given.get("models", "")
    if models and models != models_of(plan):
        raise PlanError(
            f"it was found with other nominal models than this plan's ({models}, not {models_of(plan)}): diagnose a "
            "recording of this plan's laboratories, or give the plan that it was found with."
        )
    building = given.get("building", "")
    if building and building != building_of(plan) and of_building(tables):
        raise PlanError(
            f"it holds changes of another building than this plan's ({', '.join(of_building(tables))}): delete these "
            "entries from the file, or give the plan that it was found with."
        )


def learned(tables: Mapping[str, Any], plan: Plan, base: Path) -> tuple[LearnedEntry, ...]:
    """The laws of `[[learned]]` tables, each read from the file that it names, relative to `base`.

    Raises:
        PlanError: an entry lacks a key, names a laboratory that the plan does not have, or its file holds no such law.
    """
    given = tables.get("learned", [])
    if not isinstance(given, list) or not all(isinstance(entry, dict) for entry in given):
        raise PlanError("laws that were learned are given as [[learned]] tables.")
    return tuple(entry_of(entry, plan, base) for entry in given)


def entry_of(entry: Mapping[str, Any], plan: Plan, base: Path) -> LearnedEntry:
    """One law; raises PlanError as `learned`."""
    keys = ("laboratory", "machine", "file")
    for key in keys:
        if not isinstance(entry.get(key), str):
            raise PlanError(f"{key} of [[learned]] is {entry.get(key)!r}, but must be text.")
    role, machine, path = (str(entry[key]) for key in keys)
    if role not in (MASTER, *plan.roles):
        raise PlanError(f"laboratory of [[learned]] is '{role}', which the plan does not have.")
    return LearnedEntry(role, machine, law_in(base / path, f"{role}.{machine}"))


def law_in(path: Path, name: str) -> tuple[float, ...]:
    """A law in an .npz file; raises PlanError if it cannot be read or is no list of finite numbers."""
    try:
        with np.load(path, allow_pickle=False) as file:
            law = np.asarray(file[name], dtype=np.float64)
    except (OSError, EOFError, ValueError, KeyError, BadZipFile):
        raise PlanError(
            f"Cannot read the law '{name}' in {path}: keep the file that `rths diagnose --found` wrote beside it."
        ) from None
    if law.ndim != 1 or law.size == 0 or not np.all(np.isfinite(law)):
        raise PlanError(
            f"The law '{name}' in {path} is no list of finite numbers: diagnose the recording again."
        )
    return tuple(law.tolist())
