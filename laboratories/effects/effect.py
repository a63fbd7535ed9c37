"""An entry of the catalogue of effects: its parameters and properties."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from common.plan.plan import Plan
from models.system import System

Kind = Literal["physics", "measurement"]


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect."""

    name: str
    unit: str
    null: float  # the value without the effect
    least: float  # bounds that are physically possible
    most: float
    sizes: tuple[float, ...]  # values from barely visible to strong, from which a search starts
    says: str = ""
    shape: bool = (
        False  # whether it is the effect's shape rather than its magnitude: `null` unless it is given
    )
    follows: str = (
        ""  # recorded signal whose peak scales the sizes; empty: the site's signal of the same unit
    )
    believed: float = math.inf  # largest value that a search accepts
    bends_by: str = (
        ""  # of a level that a signal does not exceed: the shape that says how suddenly it bends there
    )
    swallows: bool = (
        False  # whether it is a width of a motion that comes to nothing: a search goes up to what is reached
    )
    defining: bool = (
        False  # whether its effect is another one where it is least: yielding without a loop is elastic
    )
    smoothing: float = (
        0.0  # for a velocity that smooths a law near rest: its share of the peak velocity in a search
    )

    @property
    def default(self) -> float | None:
        """The value of a parameter that is not given; None where it must be given."""
        return self.null if self.shape else None


@dataclass(frozen=True)
class Law:
    """One formula of an effect that has several."""

    name: str  # its name in texts
    shapes: Mapping[str, float]  # its parameters of shape, with the values from which a fit starts
    model: str = (
        ""  # the model of `models.specimens` that it is, fitted to force over deformation for a start
    )
    renamed: Mapping[str, str] = field(
        default_factory=dict
    )  # the model's names of parameters where they differ
    fixed: Mapping[str, float] = field(
        default_factory=dict
    )  # its parameters of shape that a fit leaves as they are
    beside: Mapping[str, Mapping[str, str]] = field(
        default_factory=dict
    )  # other effects that the model holds too, with the model's names of their parameters


@dataclass(frozen=True)
class Contact:
    """An end stop: the readings in which a search finds its position, and the stiffnesses from which it starts."""

    motion: str  # reading of the moving part's displacement, m
    force: str  # reading of the force on it, N
    place: str  # name of the parameter for the distance from the middle to the stop, m
    stiffness: str  # name of the parameter for its stiffness, N/m
    starts: tuple[float, ...]  # stiffnesses from which a fit starts, soft to hard


def no_starts(_plan: Plan) -> tuple[float, ...]:
    """The default of `Effect.starts`: no plan needs other sizes."""
    return ()


@dataclass(frozen=True)
class Effect:
    """An effect that a plan's nominal models leave out.

    All code that needs a property of an effect (a search, a page, the blind trial) reads these fields, never its name.
    """

    name: str
    site: str  # in the building, the link or a kind of laboratory (laboratories/effects/sites.py)
    kind: Kind
    says: str
    parameters: tuple[Parameter, ...]
    reference: str
    apply: Callable[..., System]  # applies it to a system; takes the parameters by name
    actuators: tuple[str, ...] = ()  # models of [actuator] that can have it, empty for any
    signal: str = ""  # the reading that it falsifies, empty for an effect on the machine itself
    fault: str = ""  # the kind of error of that reading, which the effects on all signals share
    in_samples: bool = (
        False  # visible in single samples (noise, rounding), so that no fit of waveforms finds it
    )
    random: bool = False  # noise: a prediction without noise leaves it out
    contact: Contact | None = None  # an end stop: each impact depends on the ones before it
    shifts_time: bool = False  # moves a motion in time, so that a search starts at the shift by correlation
    motionless: bool = False  # adds to a reading what no motion causes, as a constant, and so imitates none
    timed: bool = False  # acts on rates, or delays, so that data whose times have no meaning cannot show it
    of_loop: bool = False  # a linear part of a servo loop, found with its other parts in a frequency response
    starts: Callable[[Plan], tuple[float, ...]] = (
        no_starts  # sizes for plans for which the parameter's own fail
    )
    laws: tuple[Law, ...] = ()  # its formulas; the parameter `law` is an index into them
    further: tuple[Parameter, ...] = ()  # optional parameters: `law`, and shapes of some laws

    @property
    def every(self) -> tuple[Parameter, ...]:
        """All parameters."""
        return (*self.parameters, *self.further)

    def law(self, values: Mapping[str, float]) -> Law | None:
        """The formula that these parameters choose, None for an effect with a single one."""
        return self.laws[int(values.get("law", 0.0))] if self.laws else None

    def under(self, place: int, values: Mapping[str, float]) -> dict[str, float]:
        """Parameters for the formula `laws[place]`, with the shapes from which its fit starts."""
        kept = {item.name: values[item.name] for item in self.parameters}
        law = self.laws[place]
        return kept | dict(law.shapes) | dict(law.fixed) | ({"law": float(place)} if place else {})

    @property
    def family(self) -> str:
        """The effect's name, or the common name of the effects of one kind on different readings."""
        return f"sensor: {self.fault}" if self.signal else self.name

    def fits(self, plan: Plan) -> bool:
        """Whether the plan's laboratory can have the effect."""
        return not self.actuators or plan.actuator.model in self.actuators

    def values(self, given: Mapping[str, float]) -> dict[str, float]:
        """All parameters by name, with defaults for those not given."""
        defaults = {item.name: item.default for item in self.parameters if item.default is not None}
        return defaults | dict(given)
