"""The findings as a reality: fitted nominal parameters, effects, and the laws learned from the rest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from common.errors import InputError
from common.plan.kinds import TABLES_OF_KIND, known_kind
from common.plan.plan import Plan
from common.reality.found import LearnedEntry, building_of, models_of
from common.reality.reality import OF_LABORATORY, TRUE_TABLES
from common.reality.spread import Spread
from common.roles import MASTER, name_of
from diagnosis.findings.for_prediction.spread import spread
from diagnosis.findings.found import Diagnosis, laid
from diagnosis.recorded.record import Record
from laboratories.effects.sites import LINK
from models.system import System

Tables = dict[str, Any]


class FoundReality(NamedTuple):
    """The tables of a reality file, and the contents of the file beside it: learned laws, and uncertainties."""

    tables: Tables
    learned: tuple[LearnedEntry, ...]
    spread: Spread


def as_reality(found: Mapping[str, Diagnosis]) -> FoundReality:
    """The reality that follows from the diagnoses of one test, by slave; the master's laboratory is the first's.

    Raises:
        InputError: no reality can express it, because a slave without a name shares the master's tables.
    """
    first = next(iter(found.values()))
    plan = first.record.plans[MASTER]
    origin = {"models": models_of(plan), "building": building_of(plan)}
    tables: Tables = {"found": origin | {"recording": first.record.run.path.name}}
    tables |= changed(plan.tables(), moved(first, MASTER).tables(), TRUE_TABLES)
    for role, item in found.items():
        if role != MASTER:
            lay_slave(tables, plan, role, moved(item, role))
    rows = [row for item in found.values() for row in entries(item)]
    tables["effect"] = [row for place, row in enumerate(rows) if row not in rows[:place]]
    laws = dict.fromkeys(law.entry for item in found.values() for law in item.learned)
    return FoundReality(tables, tuple(laws), spread(found))


def moved(found: Diagnosis, role: str) -> Plan:
    """The plan of a role with the nominal parameters as the diagnosis moved them."""
    system = System(found.record.plans[role])
    for verdict in found.verdicts:
        if verdict.search.data.part.role == role:
            system = laid(system, verdict, {})
    return system.plan


def changed(planned: Tables, real: Tables, names: tuple[str, ...]) -> Tables:
    """The differences between some tables, nested tables included."""
    result: Tables = {}
    for name in names:
        before, after = planned.get(name, {}), real.get(name, {})
        rows = {
            key: changed(before, after, (key,))[key] if isinstance(value, dict) else value
            for key, value in after.items()
            if value != before.get(key)
        }
        if rows:
            result[name] = rows
    return result


def lay_slave(tables: Tables, plan: Plan, role: str, real: Plan) -> None:
    """Add a slave's own parameters to the tables: of a named slave in tables of its own."""
    planned, name = plan.of(role).tables(), name_of(role)
    taken = tuple(one for one in TABLES_OF_KIND[known_kind(plan.kinds[role])] if one in OF_LABORATORY)
    if name:
        shared = {one: planned[one] | tables.get(one, {}) for one in taken if one in planned}
        rows = changed(shared, real.tables(), taken)
        if rows:
            tables.setdefault("slave", {})[name] = rows
        return
    if known_kind(plan.kinds[role]) == known_kind(plan.kinds.get(MASTER, "none")):
        raise InputError(
            "Nothing can be written with --found: the slave has no name and shares the master's tables; name it in the "
            "plan, as [slave.NAME], and give that plan with --plan."
        )
    tables |= changed(planned, real.tables(), taken)


def entries(found: Diagnosis) -> list[Tables]:
    """The effects as [[effect]] tables, in the order in which they were laid."""
    record = found.record
    values = [pair for verdict in found.verdicts for pair in verdict.search.chosen.values.items()]
    values += [(item.effect, {item.parameter: item.value}) for item in found.readings]
    values += [
        (item.effect, {key: size for key, (size, _) in item.parameters.items()}) for item in found.link
    ]
    return [entry(record, name, given) for name, given in values]


def entry(record: Record, name: str, values: Mapping[str, float]) -> Tables:
    """One [[effect]] table: the effect's name in the catalogue, and the laboratory that has it."""
    for lab in record.labs:
        if name in lab.effects():
            plain = name.removeprefix(lab.before)
            return {"name": plain, "laboratory": lab.role, **plain_values(values)}
    slave = record.other.role if record.other else ""
    named = {"slave": name_of(slave)} if record.catalogue[name].site == LINK and name_of(slave) else {}
    return {"name": name, **named, **plain_values(values)}


def plain_values(values: Mapping[str, float]) -> dict[str, float]:
    """Numbers as TOML holds them."""
    return {key: float(value) for key, value in values.items()}
