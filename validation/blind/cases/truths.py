"""True parameters of a case: drawn inside the plan's tolerances, with a drawn noise, and changed by effects."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from common.plan.kinds import TABLES_OF_KIND, known_kind
from common.plan.plan import Plan
from common.plan.schema import plain
from common.reality import reality as realities
from common.roles import MASTER, SLAVE, name_of
from laboratories.effects.effect import Effect
from laboratories.kind import Kind
from laboratories.kinds import KINDS, kind_of, kinds_of
from models.registry import Array
from models.system import Effects, System
from validation.blind import lots
from validation.blind.cases.basis import log_uniform
from validation.blind.cases.case import Laid
from validation.blind.library import Library
from validation.blind.lots import Lot

# Drawn one after the other from one generator, because the published cases were; every other parameter has its own.
UNCERTAIN = {
    "structure": ("mass", "stiffness", "damping"),
    "column": ("stiffness",),
    "actuator": ("gain", "delay", "time_constant"),
    "table": ("frequency", "damping_ratio", "delay"),
    "damper": ("mass", "stiffness", "damping", "motor_time_constant"),
}
# Factor on the plan's noise, the same for all sensors: from sensors twice as good as stated to those in a noisy hall.
NOISE = (0.5, 3.0)
TWO_TOLERANCES = 2.0  # standard deviations: 95 of 100 normal parameters are within
ROUNDING = 1e-12  # relative, of products of a few factors
# Tolerances: one normal draw in fifteen thousand is larger, and would have the wrong sign at 25 %.
MOST_MOVED = 4.0
Move = Callable[[np.random.Generator], float]


def draw_truths(lot: Lot, plan: Plan, *, normal: bool = False) -> dict[str, Any]:
    """True parameters inside the plan's tolerances, and the true noise, in the tables of a reality.

    With `normal` they are normal about the nominal ones, with the tolerances as standard deviations.
    """
    generator, tables = lots.generator(*lot, "truths"), plan.tables()
    move = about if normal else inside
    building = {
        name: varied(tables["structure"][name], tolerance(plan, "structure", name), generator, move)
        for name in of_building(plan)
    }
    factors = {
        f"{table}.{name}": varied(1.0, tolerance(plan, table, name), generator, move)
        for table, names in UNCERTAIN.items()
        for name in names
        if table != "structure"
    }
    noise = log_uniform(generator, *NOISE)
    truths = {
        "structure": building,
        "sensors": {name: noise * level for name, level in tables["sensors"].items()},
    }
    for role, kind in kinds_of(plan).items():
        place = truths
        if role not in (MASTER, SLAVE):
            place = truths.setdefault(SLAVE, {}).setdefault(name_of(role), {})
        place |= of_laboratory(lot, plan, (role, kind), factors, noise, move)
    return truths


def inside(generator: np.random.Generator) -> float:
    """A move in tolerances, uniform between -1 and 1."""
    return float(generator.uniform(-1.0, 1.0))


def about(generator: np.random.Generator) -> float:
    """A normal move, with the tolerance as standard deviation."""
    return float(np.clip(generator.standard_normal(), -MOST_MOVED, MOST_MOVED))


def of_laboratory(
    lot: Lot, plan: Plan, whose: tuple[str, Kind], factors: Mapping[str, float], noise: float, move: Move
) -> dict[str, Any]:
    """The tables of a laboratory whose true parameters differ from the nominal ones, each by a factor.

    `factors` are those of the plan's own tables, which are drawn for all laboratories together.
    """
    role, kind = whose
    seen = plan.of(role)
    system = System(seen)
    for name in parameters(kind, seen):
        factor = factors.get(name) if role in (MASTER, SLAVE) else None
        if factor is None:
            own = lots.generator(*lot, "truths", name_of(role), name)
            factor = varied(1.0, kind.tolerance(seen, name), own, move)
        system = kind.scaled(system, name, factor)
    if kind.name not in KINDS:
        levels = zip(kind.channels.names, kind.noise(seen).tolist(), strict=True)
        system = kind.noisy(system, {name: noise * level for name, level in levels if level > 0.0})
    tables = {}
    for name in TABLES_OF_KIND[known_kind(plan.kinds[role])]:
        before, after = (plain(getattr(one, name)) for one in (seen, system.plan))
        tables[name] = changed(before, after)
    return {name: table for name, table in tables.items() if table}


def changed(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """The entries of a table that have changed."""
    found = {}
    for name, value in after.items():
        new = changed(before.get(name, {}), value) if isinstance(value, dict) else value
        if new != ({} if isinstance(value, dict) else before.get(name)):
            found[name] = new
    return found


def of_building(plan: Plan) -> Sequence[str]:
    """The uncertain parameters of the building: its dashpots, or the damping ratio in their place."""
    ratio = plan.structure.damping_ratio > 0.0
    names = UNCERTAIN["structure"]
    return [("damping_ratio" if ratio and name == "damping" else name) for name in names]


def parameters(kind: Kind, plan: Plan) -> list[str]:
    """The uncertain parameters of a laboratory that are not zero; `plan` as its role sees it."""
    names = (name for machine in kind.machines(plan) for name in machine.parameters)
    return [name for name in names if kind.planned(plan, name) != 0.0]


def varied(value: Any, width: float, generator: np.random.Generator, move: Move) -> Any:
    """A value, or each of several, moved by relative widths of itself; a matrix as a whole, which stays symmetric."""
    if isinstance(value, list) and isinstance(value[0], list):
        factor = varied(1.0, width, generator, move)
        return [[factor * item for item in row] for row in value]
    if isinstance(value, list):
        return [varied(item, width, generator, move) for item in value]
    return value * (1.0 + width * move(generator))


def tolerance(plan: Plan, table: str, name: str) -> float:
    """Relative tolerance of a nominal parameter of one of the plan's own tables."""
    return plan.tolerances.parameters.get(f"{table}.{name}", plan.tolerances.default)


def is_inside(
    laid: Iterable[Laid], truths: dict[str, Any], plan: Plan, library: Library, most: float = 1.0
) -> bool:
    """Whether effects of the catalogue move nothing but known parameters, none by more than `most` tolerances."""
    true = realities.true_plan(truths, plan)
    moved: dict[str, System] = {}
    for item in laid:
        effect, role = library.catalogue[item.name], item.role or MASTER
        system = moved.get(role, System(true.of(role)))
        moved[role] = effect.apply(system, **effect.values(item.parameters))
    return bool(moved) and all(
        stays_inside(plan, role, true.of(role), system, most) for role, system in moved.items()
    )


def is_truly_off(
    truths: dict[str, Any], plan: Plan, placed: tuple[str, Effect], found: dict[str, float], most: float
) -> bool:
    """Whether an effect (role, effect) as it was found only moves known parameters, of which one is truly far off.

    That is by more than `most` tolerances from its nominal value, to the side on which it was found.
    """
    role, effect = placed
    true = realities.true_plan(truths, plan).of(role)
    moved = effect.apply(System(plan.of(role)), **effect.values(found))
    pairs = zip(departures(plan, role, moved.plan), departures(plan, role, true), strict=True)
    return moved.effects == Effects() and any(
        bool(np.any(there * np.sign(here) > most * width)) for (here, width), (there, _) in pairs
    )


def stays_inside(plan: Plan, role: str, true: Plan, moved: System, most: float) -> bool:
    """Whether a role's true plan with its effects is within `most` tolerances of the whole plan."""
    there = moved.plan.tables()
    return (
        moved.effects == Effects()
        and all(
            bool(np.all(np.abs(off) <= most * width + ROUNDING))
            for off, width in departures(plan, role, moved.plan)
        )
        and all(there[name] == table for name, table in true.tables().items() if name not in UNCERTAIN)
    )


def departures(plan: Plan, role: str, there: Plan) -> list[tuple[Array, float]]:
    """By what share each known parameter of a role's plan `there` differs from the nominal one, and its tolerance."""
    nominal = plan.of(role)
    ours, theirs = nominal.tables()["structure"], there.tables()["structure"]
    result = [
        (share(theirs[name], ours[name]), tolerance(plan, "structure", name)) for name in of_building(plan)
    ]
    if role in plan.kinds:
        kind = kind_of(plan, role)
        result += [
            (share(kind.planned(there, name), kind.planned(nominal, name)), kind.tolerance(nominal, name))
            for name in parameters(kind, nominal)
        ]
    return result


def share(value: Any, nominal: Any) -> Array:
    """By what share a value, or each of several, differs from the nominal one."""
    found: Array = np.asarray(value) / np.asarray(nominal) - 1.0
    return found
