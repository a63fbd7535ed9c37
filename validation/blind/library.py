"""What a case of the blind trial may hide: the catalogue, other formulas of it, and effects outside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from models.effects.effect import Effect

LABS = {
    "master": "validation.blind.labs.column_lab:ColumnLab",
    "slave": "validation.blind.labs.table_lab:TableLab",
}
UNDRAWN = ("sensor.delay",)  # one family more would change the case behind every seed
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


def shipped() -> Library:
    """What the catalogue and the independent laboratories of this package let a trial hide."""
    from models.effects import CATALOGUE
    from validation.blind.labs import FORMULAS, UNCATALOGUED

    strangers = {
        name: Stranger(site, dict(zip(parameters, ranges, strict=True)))
        for name, (site, parameters, ranges) in UNCATALOGUED.items()
    }
    catalogue = {name: effect for name, effect in CATALOGUE.items() if family(name) not in UNDRAWN}
    return Library(catalogue, FORMULAS, strangers)


def site_of(name: str) -> str:
    """The site of an effect of the catalogue, by its name."""
    return name.rpartition(".")[0] if name.startswith("sensor.") else name.partition(".")[0]


def family(name: str) -> str:
    """Effects that exist once per signal are one family, so that a draw meets each kind alike."""
    return f"sensor.{name.rpartition('.')[2]}" if name.startswith("sensor.") else name


def laboratory(site: str) -> str:
    """Which laboratory a part stands in: master or slave; raises KeyError for a part that stands in none."""
    if site.startswith("sensor."):
        return "master" if site.startswith("sensor.column_") else "slave"
    return {"actuator": "master", "column": "master", "table": "slave", "damper": "slave"}[site]
