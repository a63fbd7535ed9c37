"""Cases of the blind trial, drawn from a seed.

Every draw of a case has a name and a random generator of its own, hashed from seed, set, number of the case and
that name (`lots`): a case is the same whatever the number of cases, and a catalogue that grows leaves all cases
that hide none of the new effects as they were. The sets share no draw (`sets`).

The seed in a case's plan says nothing about the case: it is a draw of its own.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from common.errors import InputError
from common.plan import read as plans
from common.plan.plan import Plan
from common.plan.schema import nearest
from common.terminal import cli
from laboratories.effects.effect import Parameter
from models.ground_motion.motions import MOTIONS
from models.system import Effects, System
from validation.blind import library as libraries
from validation.blind import lots
from validation.blind.library import LABS, PARTS, Library, role_at
from validation.blind.lots import Lot
from validation.blind.sets import SETS, SHARES

KINDS = tuple(SHARES)

UNCERTAIN = {
    "structure": ("mass", "stiffness", "damping"),
    "column": ("stiffness",),
    "actuator": ("gain", "delay", "time_constant"),
    "table": ("frequency", "damping_ratio", "delay"),
    "damper": ("mass", "stiffness", "damping", "motor_time_constant"),
}
NOISE = (0.5, 3.0)  # factor on the plan's noise, all sensors alike
PEAK_DRIFT = (3e-3, 10e-3)  # m, of the linear building
WITH_DAMPER = 0.75  # share of the cases
PATIENCE = 200_000  # draws without a case that was asked for
ROUNDING = 1e-12


@dataclass(frozen=True)
class Laid:
    """An effect that a case hides."""

    name: str
    site: str
    parameters: dict[str, float]
    nulls: dict[str, float]  # of the parameters that say how strong it is, where it has a null value
    formula: str = ""  # of the independent laboratory, empty for the catalogue's own


@dataclass(frozen=True)
class Case:
    """One laboratory: the plan that everybody knows, and the truth that is withheld."""

    index: int
    kind: str
    plan: dict[str, Any]
    truths: dict[str, dict[str, Any]]  # true parameters, in the plan's tables
    seed: int
    laid: tuple[Laid, ...] = ()
    inside: bool = False  # with its effect every parameter is still inside its tolerance: there is no gap
    logger: str = ""  # through which it is recorded, empty where the controllers' own readings are

    def reality(self, laid: tuple[Laid, ...] | None = None, *, silent: bool = False) -> dict[str, Any]:
        """The tables of the reality, with other effects or without noise where asked for.

        The noise of a case with a logger is the logger's.
        """
        laid = self.laid if laid is None else laid
        tables: dict[str, Any] = {"seed": self.seed, **self.truths}
        if silent or self.logger:
            tables["sensors"] = dict.fromkeys(self.truths["sensors"], 0.0)
        if self.kind in ("formula", "unknown"):
            lab = role_at(self.laid[0].site, Plan())
            tables[lab] = {"rig": {"class": LABS[lab], "options": self._options(lab, tables, laid)}}
        elif laid:
            tables["effect"] = [{"name": item.name, **item.parameters} for item in laid]
        return tables

    def _options(self, lab: str, tables: dict[str, Any], laid: tuple[Laid, ...]) -> dict[str, Any]:
        parts = {name: self.plan[name] | tables.get(name, {}) for name in PARTS[lab]}
        effects = [
            {"name": item.name, "formula": item.formula, "parameters": item.parameters} for item in laid
        ]
        return {**parts, "effects": effects}


def draw(
    count: int,
    seed: int,
    set_: str,
    *,
    duration: float = 30.0,
    only: Collection[str] = (),
    effects: Collection[str] = (),
    library: Library | None = None,
) -> list[Case]:
    """The first `count` cases of a set, of the kinds in `only` and with no effects but those in `effects`.

    Case k is the same whatever else is asked for; what is not asked for is passed over. With `effects`,
    clean laboratories are passed over too.

    Raises:
        InputError: an unknown kind or effect, or no such case is found.
    """
    library = library or libraries.shipped()
    for names, known in ((only, KINDS), (effects, library.names)):
        for name in names:
            if name not in known:
                raise InputError(f"Unknown '{name}': {nearest(name, known)}")
    asked = _asked_for(seed, set_, set(only or KINDS), set(effects), library)
    return [drawn(next(asked), duration, library) for _ in range(count)]


@dataclass(frozen=True)
class Beginning:
    """A case of which only the kind and the names of its effects are drawn yet."""

    index: int
    kind: str
    names: tuple[str, ...]
    lot: Lot


def _asked_for(
    seed: int, set_: str, kinds: set[str], effects: set[str], library: Library
) -> Iterator[Beginning]:
    index, last = 0, 0
    while index - last < PATIENCE:
        begun = begin(index, seed, set_, library)
        fits = effects.issuperset(begun.names) if effects else True
        if begun.kind in kinds and fits and (begun.names or (begun.kind == "clean" and not effects)):
            last = index
            yield begun
        index += 1
    wanted = ", ".join(sorted(effects)) or "any effect"
    raise InputError(f"There is no case of kind {', '.join(sorted(kinds))} with {wanted}: ask for others.")


def begin(index: int, seed: int, set_: str, library: Library) -> Beginning:
    """The kind of a case and the names of its effects."""
    lot = (seed, set_, index)
    kind = SETS[set_].kind(lot)
    match kind:
        case "catalogue":
            names: tuple[str, ...] = (of_catalogue(library, *lot, "effect"),)
        case "formula" if library.formulas:
            names = (lots.chosen(library.formulas, *lot, "effect"),)
        case "unknown" if library.strangers:
            names = (lots.chosen(library.strangers, *lot, "effect"),)
        case "pair" if len(library.catalogue) > 1:
            first = of_catalogue(library, *lot, "effect")
            names = (first, of_catalogue(library, *lot, "second effect", without=first))
        case _:
            names = ()
    return Beginning(index, kind, names, lot)


def of_catalogue(library: Library, *lot: str | int, without: str = "") -> str:
    """An effect of the catalogue; each family as likely as any other, whatever its number of signals."""
    effects = [effect for effect in library.catalogue.values() if effect.name != without]
    family = lots.chosen({effect.family for effect in effects}, *lot)
    return lots.chosen((effect.name for effect in effects if effect.family == family), *lot)


def drawn(begun: Beginning, duration: float, library: Library) -> Case:
    """The rest of a case."""
    lot = begun.lot
    plan = draw_plan(lot, duration)
    case = Case(
        begun.index,
        begun.kind,
        plan.tables(),
        draw_truths(lots.generator(*lot, "truths"), plan),
        int(lots.generator(*lot, "noise").integers(2**31)),
        tuple(draw_effect(lot, begun.kind, name, library) for name in begun.names),
        logger=SETS[str(lot[1])].logger(lot),
    )
    return replace(case, inside=is_inside(case, plan, library))


def draw_plan(lot: Lot, duration: float) -> Plan:
    """The default test with another motion, scaled to a sensible drift, with the damper or without."""
    generator = lots.generator(*lot, "plan")
    record = lots.chosen(MOTIONS, *lot, "motion")
    damper = bool(generator.random() < WITH_DAMPER)
    peak = log_uniform(generator, *PEAK_DRIFT)
    tables = _default().tables()
    tables["test"] |= {"name": "blind", "duration": duration, "seed": int(generator.integers(2**31))}
    tables["control"]["amd"] = damper
    tables["limits"]["error_energy"] = math.inf  # what an effect does to the loop is what is asked for
    tables["ground_motion"] = {"record": record, "scale": round(peak / peak_drift(record, damper), 4)}
    return plans.from_tables(tables, _default().base)


def _default() -> Plan:
    return plans.load(cli.plan_path("default"))


@cache
def peak_drift(record: str, damper: bool) -> float:
    """Peak drift (m) of the default test's linear building under an unscaled record; the damper as a dashpot."""
    from scipy.signal import lsim

    from loop import substructure

    tables = _default().tables()
    tables["ground_motion"] = {"record": record, "scale": 1.0}
    plan = plans.from_tables(tables, _default().base)
    ground = substructure.ground_rows(plan, substructure.motion(plan))[0]
    mass, stiffness = plan.structure.mass[0], plan.structure.stiffness[0]
    damping = plan.structure.damping[0] + (plan.control.gain if damper else 0.0)
    t = np.arange(ground.size) * plan.test.interval
    _, drift, _ = lsim(([-1.0], [1.0, damping / mass, stiffness / mass]), ground, t)
    return float(np.max(np.abs(drift)))


def draw_truths(generator: np.random.Generator, plan: Plan) -> dict[str, dict[str, Any]]:
    """True parameters inside the plan's tolerances, and the true noise."""
    tables = plan.tables()
    truths: dict[str, dict[str, Any]] = {}
    for table, names in UNCERTAIN.items():
        truths[table] = {}
        for name in names:
            width = tolerance(plan, table, name)
            nominal = tables[table][name]
            if isinstance(nominal, list):
                truths[table][name] = [
                    value * (1.0 + width * generator.uniform(-1.0, 1.0)) for value in nominal
                ]
            else:
                truths[table][name] = nominal * (1.0 + width * generator.uniform(-1.0, 1.0))
    factor = log_uniform(generator, *NOISE)
    truths["sensors"] = {name: factor * level for name, level in tables["sensors"].items()}
    return truths


def tolerance(plan: Plan, table: str, name: str) -> float:
    """How well a nominal parameter is known, relative."""
    return plan.tolerances.parameters.get(f"{table}.{name}", plan.tolerances.default)


def draw_effect(lot: Lot, kind: str, name: str, library: Library) -> Laid:
    """An effect with its parameters, each a draw of its own; one of a pair is of good size."""
    if kind == "unknown":
        stranger = library.strangers[name]
        values = {
            key: between(lots.generator(*lot, name, key), *ends) for key, ends in stranger.ranges.items()
        }
        return Laid(name, stranger.site, values, {})
    effect = library.catalogue[name]
    formula = lots.chosen(library.formulas[name], *lot, name, "formula") if kind == "formula" else ""
    values = {
        item.name: draw_parameter(lots.generator(*lot, name, item.name), item, strong=kind == "pair")
        for item in effect.parameters
        if item.sizes and not (formula and item.smoothing)  # other formulas smooth their laws themselves
    }
    nulls = {item.name: item.null for item in effect.parameters if not item.shape}
    return Laid(name, effect.site, values, nulls, formula)


def draw_parameter(generator: np.random.Generator, item: Parameter, *, strong: bool) -> float:
    """A value between the weakest and the strongest of a parameter's sizes, log-uniform; a factor on both sides.

    With `strong`, it is in the stronger half of that range.
    """
    if item.shape or not np.isfinite(item.null):
        weak, full = item.sizes[0], item.sizes[-1]
        return between(generator, float(np.sqrt(weak * full)) if strong and not item.shape else weak, full)
    sides = distances(item)
    side = sides[int(generator.integers(len(sides)))]
    weak, full = min(side, key=abs), max(side, key=abs)
    if strong:
        weak = float(np.sign(full) * np.sqrt(weak * full))
    return item.null + between(generator, weak, full)


def distances(item: Parameter) -> list[list[float]]:
    """Sizes as distances from the null value, each side by itself; one side is mirrored where bounds allow it."""
    moves = [size - item.null for size in item.sizes if size != item.null]
    sides = [side for side in ([d for d in moves if d > 0.0], [d for d in moves if d < 0.0]) if side]
    if len(sides) == 1:
        mirrored = [-d for d in sides[0] if item.least <= item.null - d <= item.most]
        sides += [mirrored] if mirrored else []
    return sides


def between(generator: np.random.Generator, weak: float, strong: float) -> float:
    """A draw between two values: log-uniform where they have one sign, uniform otherwise."""
    if weak * strong > 0.0:
        return float(np.sign(weak)) * log_uniform(generator, abs(weak), abs(strong))
    return float(generator.uniform(weak, strong))


def log_uniform(generator: np.random.Generator, one: float, other: float) -> float:
    """A log-uniform draw between two positive values."""
    return float(np.exp(generator.uniform(*sorted((np.log(one), np.log(other))))))


def is_inside(case: Case, plan: Plan, library: Library) -> bool:
    """Whether the effects move nothing but known parameters, none of them out of its tolerance."""
    if not case.laid or case.kind not in ("catalogue", "pair"):
        return False
    tables = case.plan | {name: case.plan[name] | truth for name, truth in case.truths.items()}
    system = System(plans.from_tables(tables, plan.base))
    for item in case.laid:
        effect = library.catalogue[item.name]
        system = effect.apply(system, **effect.values(item.parameters))
    if system.effects != Effects():
        return False
    moved = system.plan.tables()
    return all(
        _near(moved[table][name], plan.tables()[table][name], tolerance(plan, table, name))
        for table, names in UNCERTAIN.items()
        for name in names
    ) and all(moved[name] == tables[name] for name in moved if name not in UNCERTAIN)


def _near(value: Any, nominal: Any, width: float) -> bool:
    ratio = np.asarray(value) / np.asarray(nominal)
    return bool(np.all(np.abs(ratio - 1.0) <= width + ROUNDING))
