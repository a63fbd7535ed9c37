"""What an entry of the catalogue says of itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from common.plan.plan import Plan
from models.system import System

Kind = Literal["physics", "measurement"]


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect."""

    name: str
    unit: str
    null: float  # the value at which the effect is not there
    least: float  # bounds that are physically possible
    most: float
    sizes: tuple[float, ...]  # from barely visible to strong, where a search starts
    says: str = ""
    shape: bool = False  # not how strong the effect is but what it looks like; it has no null value
    default: float | None = None  # of a parameter that need not be given


@dataclass(frozen=True)
class Effect:
    """An effect that a plan's nominal models leave out."""

    name: str
    site: str  # ground, structure, actuator, column, link, table, damper, sensor.<signal>
    kind: Kind
    says: str
    parameters: tuple[Parameter, ...]
    reference: str
    apply: Callable[..., System]  # lays it over a system; takes the parameters by name
    actuators: tuple[str, ...] = ()  # models of [actuator] that can have it, empty for any

    def fits(self, plan: Plan) -> bool:
        """Whether what the plan describes can have it."""
        return not self.actuators or plan.actuator.model in self.actuators

    def values(self, given: Mapping[str, float]) -> dict[str, float]:
        """All parameters by name, those not given at their default."""
        defaults = {item.name: item.default for item in self.parameters if item.default is not None}
        return defaults | dict(given)
