"""A plan with the nominal models that a diagnosis found, as far as a plan has parameters for them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w

from common.plan.kinds import TABLES_OF_KIND, known_kind
from common.plan.plan import INTERFACE, Plan
from common.reality.found import BUILDING, LearnedEntry
from common.reality.reality import Entry
from common.roles import MASTER, name_of, title
from laboratories import effects
from laboratories.column.as_table import as_table
from laboratories.effects import sites
from laboratories.effects.effect import Effect
from laboratories.kinds import kinds_of
from models.system import Effects, System
from simulation.prediction.draws import FoundLaboratories

# Relative difference between a sensor's noise and the plan's above which the plan is changed. The rms of some thousand
# samples is known to 2 %, so that a difference of 5 % is no chance.
NOISIER = 0.05
DIGITS = 3  # of a sensor's noise, which is not known better than to some parts in a thousand
PLACES = (("ground_motion", "record"), ("link.security", "folder"))  # paths of a plan, by table and key
CODE = ".py:"  # separates file and class in the name of a user's class


class UpdatedPlan(NamedTuple):
    """The updated plan, its differences from the one before, and the findings that no plan can express."""

    plan: Plan
    said: tuple[str, ...]
    unsaid: tuple[str, ...]


def update(found: FoundLaboratories, plan: Plan) -> UpdatedPlan:
    """The plan with the nominal models that were found."""
    whole = replace(found.truth.plan, ground_motion=plan.ground_motion, tolerances=plan.tolerances)
    unsaid = [f"{name} belongs to another building than this plan's." for name in found.left_out]
    for role in (MASTER, *plan.roles):
        own, noise = effects.of_role(plan, role), found.spread.noise.get(role, {})
        for entry in found.truth.of(role).effects:
            effect = own.get(entry[0])
            if (
                effect is None
                or role != holder(plan, role, effect)
                or (effect.random and effect.signal in noise)
            ):
                continue
            whole, sentence = laid(whole, role, entry, effect)
            unsaid += [sentence] if sentence else []
        whole, sentence = with_noise(whole, plan, role, noise)
        unsaid += [sentence] if sentence else []
    unsaid += [learned(law) for law in found.truth.learned]
    return UpdatedPlan(whole, tuple(differences(plan, whole)), tuple(dict.fromkeys(unsaid)))


def holder(plan: Plan, role: str, effect: Effect) -> str:
    """The role for which an effect on `role` is reported: for effects on the building the master, and so only once."""
    if effect.site in sites.BUILDING:
        return MASTER
    return next(iter(plan.roles), role) if effect.site == sites.LINK and role == MASTER else role


def laid(whole: Plan, role: str, entry: Entry, effect: Effect) -> tuple[Plan, str]:
    """The plan with an effect that parameters of a plan can express; otherwise the same plan and a sentence."""
    name, values = entry
    system = effect.apply(System(whole.of(role)), **effect.values(values))
    column, left = as_table(system.plan.column, system.effects.column)
    system = replace(
        system, plan=replace(system.plan, column=column), effects=replace(system.effects, column=left)
    )
    if not effect.random and system.effects == Effects() and system.plan.ground_motion == whole.ground_motion:
        return merged(whole, role, system.plan), ""
    given = ", ".join(f"{key} = {value:.6g}" for key, value in values.items())
    where = "" if effect.site in sites.BUILDING else f" of the {title(role)}"
    return whole, f"{name} ({given}){where} is no parameter of a plan."


def learned(law: LearnedEntry) -> str:
    """A sentence on a learned law, which no plan can express."""
    return f"The law learned for the {law.machine} of the {title(law.role)} is no parameter of a plan."


def merged(whole: Plan, role: str, own: Plan) -> Plan:
    """The whole plan with the tables of one role's laboratory and, for the master, those of the building."""
    name = name_of(role)
    if name:
        taken = TABLES_OF_KIND[known_kind(whole.kinds[role])]
        parts = {one: getattr(own, one) for one in taken if one in INTERFACE}
        return replace(whole, slaves=whole.slaves | {name: replace(whole.slaves[name], **parts)})
    kept: dict[str, Any] = {one: getattr(own, one) for one in (*INTERFACE, BUILDING) if hasattr(own, one)}
    return replace(whole, **kept)


def with_noise(whole: Plan, plan: Plan, role: str, found: Mapping[str, float]) -> tuple[Plan, str]:
    """The plan with the sensor noise found for one role, if no other laboratory of its kind shares its table."""
    kinds = kinds_of(plan)
    if role not in kinds:
        return whole, ""
    planned = dict(zip(kinds[role].channels.names, kinds[role].noise(plan.of(role)).tolist(), strict=True))
    known = {
        name: float(f"{rms:.{DIGITS}g}")
        for name, rms in found.items()
        if abs(rms - planned[name]) > NOISIER * planned[name]
    }
    if not known:
        return whole, ""
    system = kinds[role].noisy(System(whole.of(role)), known)
    alike = [one for one, kind in kinds.items() if kind.name == kinds[role].name]
    if len(alike) > 1:
        return (
            whole,
            f"The noise of the sensors of the {title(role)} alone ({', '.join(known)}) is no parameter of a plan.",
        )
    return replace(merged(whole, role, system.plan), sensors=system.plan.sensors), ""


def differences(before: Plan, after: Plan) -> list[str]:
    """The keys in which two plans differ within five digits, one line each."""

    def rows(path: str, one: Any, other: Any) -> list[str]:
        if one == other:
            return []
        if isinstance(one, dict) and isinstance(other, dict):
            return [
                row
                for key in other
                for row in rows(f"{path}.{key}" if path else key, one.get(key), other[key])
            ]
        said = text(one), text(other)
        if one is None:
            return [f"{path}: none → {said[1]}"]
        return [f"{path}: {said[0]} → {said[1]}"] if said[0] != said[1] else []

    return rows("", before.tables(), after.tables())


def text(value: Any) -> str:
    """A value in a few digits."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(text, value))}]"
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def toml(updated: UpdatedPlan, source: str, folder: Path) -> str:
    """The text of the plan for a file in `folder`, with the findings that it cannot express as comments at its head."""
    head = [f"Nominal models as found: {source}."]
    head += [f"Not in this plan: {sentence}" for sentence in updated.unsaid]
    tables = updated.plan.written()
    relocated(tables, updated.plan.base, folder)
    return "".join(f"# {line}\n" for line in head) + "\n" + tomli_w.dumps(tables)


def relocated(tables: dict[str, Any], base: Path, folder: Path) -> None:
    """Change the paths in nested tables so that they start from another folder."""
    if base.resolve() == folder.resolve():
        return
    for table, key in PLACES:
        within: Any = tables
        for name in table.split("."):
            within = within.get(name, {})
        if within.get(key) and (base / within[key]).exists():
            within[key] = moved(within[key], base, folder)
    for inner in nested(tables):
        for key in ("class", "kind"):
            if CODE in str(inner.get(key, "")):
                path, _, name = str(inner[key]).rpartition(":")
                inner[key] = f"{moved(path, base, folder)}:{name}"


def moved(path: str, base: Path, folder: Path) -> str:
    """A path from another folder to the same file."""
    return path if Path(path).is_absolute() else os.path.relpath((base / path).resolve(), folder.resolve())


def nested(tables: Mapping[str, Any]) -> list[dict[str, Any]]:
    """All tables within tables."""
    inner = [value for value in tables.values() if isinstance(value, dict)]
    return inner + [one for value in inner for one in nested(value)]
