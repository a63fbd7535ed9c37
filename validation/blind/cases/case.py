"""A case of the blind trial: the published plan, and the true laboratories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from common.plan import read as plans
from common.plan.kinds import COLUMN, TABLE
from common.reality import reality as realities
from common.reality.reality import Reality
from common.roles import MASTER, SLAVE, name_of
from validation.blind.library import MATERIAL, MATERIAL_LAB, REPLACED, parts_of, rig_of


@dataclass(frozen=True)
class Laid:
    """An effect that a case hides."""

    name: str
    site: str
    parameters: dict[str, float]
    nulls: dict[str, float]  # null values of the parameters that say how strong it is
    formula: str = ""  # of the independent laboratory, empty for the catalogue's own
    role: str = ""  # of the laboratory or the slave whose link has it; empty for the building
    alone: bool = False  # whether other laboratories of the test could have it too


@dataclass(frozen=True)
class Case:
    """One test: the published plan, and the hidden truth."""

    index: int
    kind: str
    plan: dict[str, Any]
    truths: dict[str, Any]  # true parameters, in the plan's tables
    seed: int
    laid: tuple[Laid, ...] = ()
    inside: bool = False  # with its effect every parameter is still inside its tolerance: there is no gap
    logger: str = ""  # through which it is recorded; empty where the controllers' own readings are recorded
    own: bool = False  # every laboratory of a kind of the package is played by its independent code
    normal: bool = False  # tolerances are standard deviations
    other: dict[str, Any] = field(
        default_factory=dict
    )  # tables of the plan with another motion, empty for none

    def reality(self, laid: tuple[Laid, ...] | None = None, *, silent: bool = False) -> dict[str, Any]:
        """The tables of the reality, with other effects or without noise where asked for.

        The noise of a case with a logger is the logger's.
        """
        laid = self.laid if laid is None else laid
        tables = quiet(self.truths) if silent or self.logger else self.truths
        replaced = self.replaced()
        for role in replaced:
            own = [item for item in laid if item.role == role]
            tables = with_rig(tables, role, self._rig(tables, role, own))
        effects = [
            written(item) for item in laid if item.role not in replaced and not strange_building([item])
        ]
        return {"seed": self.seed, **tables, **({"effect": effects} if effects else {})}

    def replaced(self) -> tuple[str, ...]:
        """The roles whose laboratories are replaced by rigs of the trial."""
        if self.own:
            kinds = plans.from_tables(self.plan, Path()).kinds
            return tuple(role for role, kind in kinds.items() if kind in (COLUMN, TABLE))
        return (self.laid[0].role,) if self.kind in REPLACED else ()

    def _rig(self, tables: Mapping[str, Any], role: str, laid: Sequence[Laid]) -> dict[str, Any]:
        """The table of the rig that replaces a laboratory, with the true parameters among its options."""
        kind = plans.from_tables(self.plan, Path()).kinds[role]
        planned, true = of_role(self.plan, role), of_role(tables, role)
        options: dict[str, Any] = {
            name: planned.get(name, {}) | true.get(name, {}) for name in parts_of(kind)
        }
        options["effects"] = [
            {"name": item.name, "formula": item.formula, "parameters": item.parameters} for item in laid
        ]
        rig = rig_of(kind, options)
        return rig | {"class": MATERIAL_LAB} if self.kind == MATERIAL else rig


def strange_building(laid: Sequence[Laid]) -> Laid | None:
    """The effect of no catalogue that the building has, none where it is the plan's."""
    return next((item for item in laid if not item.role and item.name.startswith("x.")), None)


def written(item: Laid) -> dict[str, Any]:
    """An effect of the catalogue in the form of a reality, with its laboratory where others could have it too."""
    return {
        "name": item.name,
        **item.parameters,
        **({"laboratory": item.role} if item.alone else {}),
    }


def of_role(tables: Mapping[str, Any], role: str) -> dict[str, Any]:
    """The tables of a role's laboratory: those of a named slave, and otherwise the plan's or the reality's own."""
    name = name_of(role)
    return dict(tables) | (tables.get(SLAVE, {}).get(name, {}) if name else {})


def with_rig(tables: Mapping[str, Any], role: str, rig: dict[str, Any]) -> dict[str, Any]:
    """The tables of a reality with a rig in place of a role's laboratory."""
    if role in (MASTER, SLAVE):
        return {**tables, role: {"rig": rig}}
    slaves = dict(tables.get(SLAVE, {}))
    slaves[name_of(role)] = {**slaves.get(name_of(role), {}), "rig": rig}
    return {**tables, SLAVE: slaves}


def quiet(truths: Mapping[str, Any]) -> dict[str, Any]:
    """The true parameters, with sensors without noise."""
    tables = dict(truths)
    for key, table in truths.items():
        if key == "sensors":
            tables[key] = dict.fromkeys(table, 0.0)
        elif key == SLAVE:
            tables[key] = {name: quiet(own) for name, own in table.items()}
        elif "noise" in table:
            tables[key] = table | {"noise": dict.fromkeys(table["noise"], 0.0)}
    return tables


def levels(truths: Mapping[str, Any]) -> dict[str, float]:
    """True rms noise of all readings by signal, those of users' kinds included."""
    found: dict[str, float] = dict(truths.get("sensors", {})) | truths.get("device", {}).get("noise", {})
    for own in truths.get(SLAVE, {}).values():
        found |= levels(own)
    return found


def reality(case: Case, laid: tuple[Laid, ...] | None = None, *, silent: bool = False) -> Reality:
    """The laboratories of a case, with other effects or without noise where asked for."""
    plan = plans.from_tables(case.plan, Path())
    return realities.from_reality(case.reality(laid, silent=silent), plan, Path())
