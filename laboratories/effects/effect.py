"""An entry of the catalogue of effects: its parameters, and the properties that others ask it for."""

from __future__ import annotations

import math
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
    shape: bool = False  # not how strong the effect is but what it looks like: at `null` unless it is given
    follows: str = (
        ""  # recorded signal whose peak scales the sizes; empty: the site's signal of the same unit
    )
    believed: float = math.inf  # largest value that a search believes
    smoothing: float = (
        0.0  # of a velocity that smooths a law at rest: its share of the peak velocity in a search
    )

    @property
    def default(self) -> float | None:
        """The value of a parameter that is not given; None where it must be given."""
        return self.null if self.shape else None


@dataclass(frozen=True)
class Law:
    """One formula of a mechanism that has several."""

    name: str  # as it stands in texts
    shapes: Mapping[str, float]  # the parameters of shape that it has, and where a fit of them starts


@dataclass(frozen=True)
class Contact:
    """An end stop that a motion hits: where a search finds its place and from which stiffness it starts."""

    motion: str  # reading that shows how far the moving part got, m
    force: str  # reading of the force on it, N
    place: str  # parameter: from the middle to the stop, m
    stiffness: str  # parameter, N/m
    starts: tuple[float, ...]  # stiffness from which a fit starts, soft to hard


def no_starts(_plan: Plan) -> tuple[float, ...]:
    """The default of `starts`: no plan needs other sizes."""
    return ()


@dataclass(frozen=True)
class Effect:
    """An effect that a plan's nominal models leave out.

    Whoever asks something of an effect (a search, a page, the blind trial) asks these fields, never its name.
    """

    name: str
    site: str  # in the building, the link or a kind of laboratory (laboratories/effects/sites.py)
    kind: Kind
    says: str
    parameters: tuple[Parameter, ...]
    reference: str
    apply: Callable[..., System]  # lays it over a system; takes the parameters by name
    actuators: tuple[str, ...] = ()  # models of [actuator] that can have it, empty for any
    signal: str = ""  # the reading that it falsifies, empty where the machine itself differs
    fault: str = ""  # what is wrong with that reading, in words; one effect per signal shares it
    in_samples: bool = False  # told from single samples (noise, rounding): no fit of waveforms looks for it
    random: bool = False  # noise: a prediction without noise leaves it out
    contact: Contact | None = None  # an end stop: each impact depends on the ones before it
    shifts_time: bool = False  # moves a motion in time: a search starts at the shift that correlation shows
    starts: Callable[[Plan], tuple[float, ...]] = no_starts  # sizes for plans where the parameter's own fail
    laws: tuple[Law, ...] = ()  # its formulas; the parameter `law` is a place among them
    further: tuple[Parameter, ...] = ()  # parameters that need not be given: `law`, and shapes of some laws

    @property
    def every(self) -> tuple[Parameter, ...]:
        """All parameters."""
        return (*self.parameters, *self.further)

    def law(self, values: Mapping[str, float]) -> Law | None:
        """The formula that these parameters choose, None where the mechanism has but one."""
        return self.laws[int(values.get("law", 0.0))] if self.laws else None

    def under(self, place: int, values: Mapping[str, float]) -> dict[str, float]:
        """Parameters for the formula at a place of `laws`, with the shapes from which a fit of it starts."""
        kept = {item.name: values[item.name] for item in self.parameters}
        return kept | dict(self.laws[place].shapes) | ({"law": float(place)} if place else {})

    @property
    def family(self) -> str:
        """The effect's name, or the one name of all effects that do the same to different readings."""
        return f"sensor: {self.fault}" if self.signal else self.name

    def fits(self, plan: Plan) -> bool:
        """Whether the laboratory that the plan describes can have the effect."""
        return not self.actuators or plan.actuator.model in self.actuators

    def values(self, given: Mapping[str, float]) -> dict[str, float]:
        """All parameters by name, those not given at their default."""
        defaults = {item.name: item.default for item in self.parameters if item.default is not None}
        return defaults | dict(given)
