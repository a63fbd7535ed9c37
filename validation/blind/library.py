"""The effects that a case of the blind trial may hide: the catalogue, other formulas of it, and effects outside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from common.errors import InputError
from common.plan.kinds import COLUMN, OWN, TABLE, TABLES_OF_KIND, known_kind
from common.plan.plan import Plan
from laboratories import effects
from laboratories.effects import sites
from laboratories.effects.effect import Effect
from laboratories.kinds import kind_of

LABS = {
    COLUMN: "validation.blind.labs.column_lab:TrueColumnLab",
    TABLE: "validation.blind.labs.table_lab:TrueTableLab",
    OWN: "validation.blind.labs.device_lab:OwnKernelLab",
}
PARTS = {
    COLUMN: ("actuator", "column", "sensors"),
    TABLE: ("table", "damper", "sensors"),
    OWN: TABLES_OF_KIND[OWN],
}
OWN_KERNEL = "own kernel"  # in place of a formula: there is no second implementation of this laboratory
MATERIAL = "material"  # kind of case whose column is a material of OpenSees
MATERIAL_LAB = "validation.blind.labs.material_lab:MaterialLab"
REPLACED = ("formula", "unknown", MATERIAL)  # kinds of cases in which a rig replaces the emulated laboratory

Reached = Mapping[str, Mapping[str, float]]  # largest magnitudes by role and signal


class Stranger(NamedTuple):
    """An effect that is not in the catalogue."""

    site: str
    ranges: Mapping[str, tuple[float, float]]  # weakest and strongest value by parameter


@dataclass(frozen=True)
class Library:
    """Effects to draw from, and where a plan's test can have them."""

    catalogue: Mapping[str, Effect]
    formulas: Mapping[str, tuple[str, ...]]  # of the independent laboratories, by effect
    strangers: Mapping[str, Stranger]
    places: Mapping[str, tuple[str, ...]] = field(
        default_factory=dict
    )  # roles by effect, none for the building's
    rigs: tuple[str, ...] = ()  # roles that a rig of the trial can replace
    unlisted: Mapping[str, Stranger] = field(default_factory=dict)  # of the sets that have a half of them

    @property
    def names(self) -> tuple[str, ...]:
        """All effects."""
        return (*self.catalogue, *self.strangers, *self.unlisted)

    def stranger(self, name: str) -> Stranger:
        """An effect that is in no catalogue."""
        return self.strangers.get(name) or self.unlisted[name]

    def half(self, name: str) -> tuple[str, ...]:
        """The names of one half of `unlisted`."""
        from validation.blind.labs.unlisted import every

        return tuple(one for one in self.unlisted if every.half(one) == name)

    def independent(self) -> tuple[str, ...]:
        """The effects of the catalogue that the independent laboratories know in any formula."""
        from validation.blind.labs import PLAIN

        known = {*self.formulas, *PLAIN}
        return tuple(name for name in self.catalogue if name in known and self.roles(name, replaced=True))

    def roles(self, name: str, *, replaced: bool) -> tuple[str, ...]:
        """The roles that can have an effect; with `replaced` those of them that a rig of the trial can replace."""
        return tuple(role for role in self.places.get(name, ()) if role in self.rigs or not replaced)


def parts_of(kind: str) -> tuple[str, ...]:
    """The tables of a plan that the rig for a kind of laboratory takes as options; `kind` as in the plan."""
    return PARTS[known_kind(kind)]


def rig_of(kind: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """The table of the rig that replaces a laboratory of a kind; for a user's kind its options name that kind."""
    told = {"kind": kind} if known_kind(kind) == OWN else {}
    return {"class": LABS[known_kind(kind)], "options": {**told, **options}}


def of_plan(plan: Plan, reached: Callable[[], Reached]) -> Library:
    """The effects that the cases of a plan may hide, by the catalogue and the laboratories of the trial.

    `reached` computes the peaks of the signals in the plan's own test, which give the sizes of effects on users' kinds.

    Raises:
        InputError: a kind of the plan cannot be loaded.
    """
    known, held = effects.of_plan(plan), {role: fitting(plan, role) for role in plan.kinds}
    places = {
        name: plan.roles if effect.site == sites.LINK else having(name, held)
        for name, effect in known.items()
    }
    found = Library(
        {name: effect for name, effect in known.items() if places[name] or effect.site in sites.BUILDING},
        *of_rigs(plan, reached),
        places,
        tuple(role for role in plan.kinds if replaceable(plan, role)),
    )
    places |= {name: sites.holders(plan, stranger.site) for name, stranger in found.strangers.items()}
    formulas = {name: those for name, those in found.formulas.items() if found.roles(name, replaced=True)}
    strangers = {name: one for name, one in found.strangers.items() if found.roles(name, replaced=True)}
    unlisted = of_no_catalogue(plan)
    places |= {name: sites.holders(plan, one.site) for name, one in unlisted.items()}
    found = Library(found.catalogue, formulas, strangers, places, found.rigs)
    fit = {
        name: one
        for name, one in unlisted.items()
        if one.site in sites.BUILDING or found.roles(name, replaced=True)
    }
    return replace(found, unlisted=fit)


def of_no_catalogue(plan: Plan) -> dict[str, Stranger]:
    """The effects of the sets of no catalogue, those of the building only where a plan's master can have them."""
    from validation.blind.labs.unlisted import building, every

    return {
        name: Stranger(every.site(name), one.ranges)
        for name, one in every.EFFECTS.items()
        if every.site(name) not in sites.BUILDING or building.fits(plan)
    }


def fitting(plan: Plan, role: str) -> set[str]:
    """The names of the effects that the laboratory of a role can have."""
    seen = plan.of(role)
    return {name for name, one in effects.of_kind(kind_of(plan, role), seen).items() if one.fits(seen)}


def having(name: str, held: Mapping[str, set[str]]) -> tuple[str, ...]:
    """The roles whose laboratory can have an effect."""
    return tuple(role for role, names in held.items() if name in names)


def of_rigs(
    plan: Plan, reached: Callable[[], Reached]
) -> tuple[dict[str, tuple[str, ...]], dict[str, Stranger]]:
    """Formulas by effect, and effects in no catalogue, of all rigs that can replace a laboratory of the plan."""
    from validation.blind.labs import FORMULAS, UNCATALOGUED, device_lab

    formulas = dict(FORMULAS)
    strangers = {
        name: Stranger(site, dict(zip(parameters, ranges, strict=True)))
        for name, (site, parameters, ranges) in UNCATALOGUED.items()
    }
    for role in own_kernels(plan):
        kind = kind_of(plan, role)
        formulas |= {effect.name: (OWN_KERNEL,) for effect in kind.effects} | device_lab.formulas(
            kind.channels
        )
        around = device_lab.uncatalogued(kind.channels, reached()[role])
        strangers |= {name: Stranger(*found) for name, found in around.items()}
    return formulas, strangers


def own_kernels(plan: Plan) -> tuple[str, ...]:
    """The roles with a laboratory of a user's kind, which the trial computes by that kind's own kernel."""
    return tuple(role for role, kind in plan.kinds.items() if known_kind(kind) == OWN)


def replaceable(plan: Plan, role: str) -> bool:
    """Whether a rig of the trial can replace a role's laboratory, because it has the models that the plan chooses."""
    from validation.blind.labs import column_lab, table_lab

    seen = plan.of(role)
    try:
        match known_kind(plan.kinds[role]):
            case "column":
                column_lab.true_values(seen.actuator, seen.column)
            case "table":
                table_lab.true_values(seen.table, seen.damper)
    except InputError:
        return False
    return True
