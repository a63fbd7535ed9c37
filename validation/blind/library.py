"""What a case of the blind trial may hide: the catalogue, other formulas of it, and effects outside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from common.plan.plan import Plan
from laboratories.effects.effect import Effect
from laboratories.effects.sites import holders

LABS = {
    "master": "validation.blind.labs.column_lab:ColumnLab",
    "slave": "validation.blind.labs.table_lab:TableLab",
}
PARTS = {"master": ("actuator", "column", "sensors"), "slave": ("table", "damper", "sensors")}


class Stranger(NamedTuple):
    """An effect that the catalogue does not hold."""

    site: str
    ranges: Mapping[str, tuple[float, float]]  # weakest and strongest value by parameter


@dataclass(frozen=True)
class Library:
    """Effects to draw from."""

    catalogue: Mapping[str, Effect]
    formulas: Mapping[str, tuple[str, ...]]  # of the independent laboratories, by effect
    strangers: Mapping[str, Stranger]

    @property
    def names(self) -> tuple[str, ...]:
        """Every effect there is."""
        return (*self.catalogue, *self.strangers)


def role_at(site: str, plan: Plan) -> str:
    """The role whose laboratory has a site, the first of several; empty where it is in no laboratory."""
    return next(iter(holders(plan, site)), "")


def shipped() -> Library:
    """What the catalogue and the independent laboratories of this package let a trial hide."""
    from laboratories.effects import CATALOGUE
    from validation.blind.labs import FORMULAS, UNCATALOGUED

    strangers = {
        name: Stranger(site, dict(zip(parameters, ranges, strict=True)))
        for name, (site, parameters, ranges) in UNCATALOGUED.items()
    }
    return Library(CATALOGUE, FORMULAS, strangers)
