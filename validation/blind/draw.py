"""Cases of the blind trial, drawn from a seed.

Every draw of a case has a name and a random generator of its own, hashed from seed, set, number of the case and
that name (`lots`): a case is the same whatever the number of cases, and a catalogue that grows leaves all cases
that hide none of the new effects as they were. The sets share no draw (`sets`).

The seed in a case's plan says nothing about the case: it is a draw of its own.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np

from common.errors import InputError
from common.plan.schema import nearest
from common.roles import MASTER
from laboratories.effects.effect import Parameter
from validation.blind import lots
from validation.blind.cases.basis import TrialBasis, another_motion, basis, draw_plan, log_uniform
from validation.blind.cases.case import Case, Laid
from validation.blind.cases.truths import TWO_TOLERANCES, draw_truths, is_inside
from validation.blind.library import MATERIAL, REPLACED, Library
from validation.blind.lots import Lot
from validation.blind.sets import MILD, SETS, SHARES

KINDS = (*SHARES, "many", MATERIAL)
# Draws after which a wanted case is taken not to exist. A single effect comes at least once in about 600 cases, a given
# pair once in some ten thousand; the draws take about two minutes.
PATIENCE = 200_000


def draw(
    count: int,
    seed: int,
    set_: str,
    *,
    trial: TrialBasis | None = None,
    only: Collection[str] = (),
    effects: Collection[str] = (),
) -> list[Case]:
    """The first `count` cases of a set, of the kinds in `only` and with no effects but those in `effects`.

    Case k is the same for any choice; other cases are skipped. With `effects`, clean laboratories are skipped too.
    Without a `trial` the cases are of the default test.

    Raises:
        InputError: an unknown kind or effect, or no such case is found.
    """
    trial = trial or basis()
    for names, known in ((only, KINDS), (effects, trial.library.names)):
        for name in names:
            if name not in known:
                raise InputError(f"Unknown '{name}': {nearest(name, known)}")
    asked = _asked_for(seed, set_, set(only or KINDS), set(effects), trial.library)
    return [drawn(next(asked), trial) for _ in range(count)]


def numbered(
    numbers: Collection[int], seed: int, set_: str, *, trial: TrialBasis | None = None
) -> list[Case]:
    """The cases of a set with these numbers, each once and in their order; without a `trial` of the default test.

    Raises:
        InputError: the set has no case of a number, because the plan has no effect of the kind that was drawn.
    """
    trial = trial or basis()
    begun = [begin(index, seed, set_, trial.library) for index in sorted(set(numbers))]
    for one in begun:
        if not exists(one):
            raise InputError(
                f"Case {one.index} does not exist: it is of the kind {one.kind}, of which this plan has no effect."
            )
    return [drawn(one, trial) for one in begun]


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
        if begun.kind in kinds and fits and exists(begun) and (begun.names or not effects):
            last = index
            yield begun
        index += 1
    wanted = ", ".join(sorted(effects)) or "any effect"
    raise InputError(
        f"There is no case of kind {', '.join(sorted(kinds))} with {wanted}: choose another kind or effect."
    )


def exists(begun: Beginning) -> bool:
    """Whether the plan has such a case: a clean laboratory, or an effect of the kind that was drawn."""
    return bool(begun.names) or begun.kind == "clean"


def begin(index: int, seed: int, set_: str, library: Library) -> Beginning:
    """The kind of a case and the names of its effects."""
    lot = (seed, set_, index)
    kind = SETS[set_].kind(lot)
    names: tuple[str, ...] = ()
    match kind:
        case "catalogue":
            names = (of_catalogue(library, *lot, "effect"),)
        case "formula" if library.formulas:
            names = (lots.chosen(library.formulas, *lot, "effect"),)
        case "unknown" if SETS[set_].half:
            those = sorted(library.half(SETS[set_].half), key=lambda name: lots.number(seed, set_, name))
            names = (those[SETS[set_].turn(lot) % len(those)],) if those else ()
        case "unknown" if library.strangers:
            names = (lots.chosen(library.strangers, *lot, "effect"),)
        case "pair" if len(library.catalogue) > 1:
            known = library.independent() if SETS[set_].own else tuple(library.catalogue)
            first = of_catalogue(library, *lot, "effect", among=known)
            rest = [name for name in known if name != first]
            names = (first, of_catalogue(library, *lot, "second effect", among=rest))
        case "many":
            names = several(library, lot)
        case "material":
            names = (f"opensees.{SETS[set_].material(lot)}",)
    return Beginning(index, kind, names, lot)


def several(library: Library, lot: Lot) -> tuple[str, ...]:
    """One to nine effects of the catalogue, each once."""
    count = int(lots.generator(*lot, "count").integers(1, MILD + 1))
    names: list[str] = []
    for place in range(min(count, len(library.catalogue))):
        rest = [name for name in library.catalogue if name not in names]
        names.append(of_catalogue(library, *lot, f"effect {place}", among=rest))
    return tuple(names)


def of_catalogue(library: Library, *lot: str | int, among: Collection[str] = ()) -> str:
    """An effect of the catalogue; all families are equally likely, whatever their number of signals."""
    effects = [effect for effect in library.catalogue.values() if not among or effect.name in among]
    family = lots.chosen({effect.family for effect in effects}, *lot)
    return lots.chosen((effect.name for effect in effects if effect.family == family), *lot)


def drawn(begun: Beginning, trial: TrialBasis) -> Case:
    """The rest of a case."""
    lot, kind = begun.lot, begun.kind
    plan = draw_plan(lot, trial)
    chosen = SETS[str(lot[1])]
    truths = draw_truths(lot, plan, normal=chosen.normal)
    noise = int(lots.generator(*lot, "noise").integers(2**31))
    laid = tuple(draw_effect(lot, kind, name, trial.library, own=chosen.own) for name in begun.names)
    most = TWO_TOLERANCES if chosen.normal else 1.0
    moved = kind in ("catalogue", "pair", "many")
    inside = moved and is_inside(laid, truths, plan, trial.library, most)
    other = another_motion(lot, plan, trial).tables() if chosen.twice else {}
    more = (chosen.logger(lot), chosen.own, chosen.normal, other)
    return Case(begun.index, kind, plan.tables(), truths, noise, laid, inside, *more)


def draw_effect(lot: Lot, kind: str, name: str, library: Library, *, own: bool = False) -> Laid:
    """An effect with its parameters, each a draw of its own; effects of a pair are strong, one of many is mild.

    Where several laboratories can have it, one of them is drawn, too. With `own` it is in an independent laboratory.
    """
    if kind == MATERIAL:
        return draw_material(lot, name)
    roles = library.roles(name, replaced=kind in REPLACED or own)
    role, alone = lots.chosen(roles, *lot, name, "laboratory") if roles else "", len(roles) > 1
    if kind == "unknown":
        stranger = library.stranger(name)
        values = {
            key: between(lots.generator(*lot, name, key), *ends) for key, ends in stranger.ranges.items()
        }
        return Laid(name, stranger.site, values, {}, role=role, alone=alone)
    effect = library.catalogue[name]
    formulas = library.formulas.get(name, ()) if kind == "formula" or own else ()
    formula = lots.chosen(formulas, *lot, name, "formula") if formulas else ""
    part = {"pair": "strong", "many": "mild"}.get(kind, "")
    values = {
        item.name: draw_parameter(lots.generator(*lot, name, item.name), item, part)
        for item in effect.parameters
        if item.sizes and not (formula and item.smoothing)  # other formulas smooth their laws themselves
    }
    nulls = {item.name: item.null for item in effect.parameters if not item.shape}
    return Laid(name, effect.site, values, nulls, formula, role, alone)


def draw_material(lot: Lot, name: str) -> Laid:
    """A material of OpenSees with its parameters, in place of the master's column."""
    from validation.blind.labs.materials import BENDS, MATERIALS

    ranges = {"d": BENDS, **MATERIALS[name.removeprefix("opensees.")].ranges}
    values = {key: between(lots.generator(*lot, name, key), *ends) for key, ends in ranges.items()}
    return Laid(name, "column", values, {}, role=MASTER)


def draw_parameter(generator: np.random.Generator, item: Parameter, part: str = "") -> float:
    """A log-uniform value between the weakest and the strongest of a parameter's sizes; of a factor, on either side.

    `part` limits it to the "strong" or the "mild" half of that range.
    """
    if item.shape or not np.isfinite(item.null):
        weak, full = item.sizes[0], item.sizes[-1]
        return between(generator, *((weak, full) if item.shape else halved(weak, full, part)))
    sides = distances(item)
    side = sides[int(generator.integers(len(sides)))]
    return item.null + between(generator, *halved(min(side, key=abs), max(side, key=abs), part))


def halved(weak: float, full: float, part: str) -> tuple[float, float]:
    """The ends of a range, or of its strong or mild half on a logarithmic scale."""
    if not part:
        return weak, full
    middle = float(np.sqrt(weak * full)) if full > 0.0 else -float(np.sqrt(weak * full))
    return (middle, full) if part == "strong" else (weak, middle)


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
