"""What a kind of laboratory says of itself: its channels, its place in the building, its model, its way to rest.

Every laboratory is driven alike. At each tick it is told a target for the interval's end with the target's rates, and
a force for its motor where it has one. Its compensator makes of that a command, which its transfer system follows;
what it measures goes back, and one of the measured forces enters the building.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from enum import Enum
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from common.plan.laboratory_tables import ForceCorrection
from common.plan.plan import Plan
from common.safety.ramp import Ramp
from common.signals import Channels
from models.registry import Array
from models.system import System

if TYPE_CHECKING:
    from laboratories.effects.effect import Effect


class Follows(Enum):
    """What of the building's motion a laboratory follows, and with it how its force acts on the building."""

    DRIFT = "drift"  # of a storey; the force resists it, between the storey's two floors
    FLOOR = "floor"  # absolute displacement of a floor; the force pushes that floor


class Coupling(NamedTuple):
    """The place of a laboratory in the building of a plan."""

    follows: Follows
    place: int  # storey or floor, from 1
    ratio: float  # target over that motion
    scale: float  # force on the building over force measured
    effort: (
        float  # motor's force in the laboratory over velocity of the floor or drift, N·s/m; 0 without a motor
    )
    correction: ForceCorrection  # of the measured force before it enters the equation of motion
    stiffness: float  # N/m, nominal, of what the building feels against that motion; 0 where it is none
    damping: float  # N·s/m, likewise
    mass: float  # kg, likewise
    share: float  # of the storey's numerical columns, which the specimen stands for


class Chosen(NamedTuple):
    """The compensator that a plan chooses for a laboratory."""

    kind: str
    parameters: Mapping[str, float]
    where: str  # table of the plan's file, for sentences about it


class Limited(NamedTuple):
    """The names of limits on how a laboratory's command may move, empty for none."""

    step: str = ""  # largest change of the command within an interval
    velocity: str = ""
    acceleration: str = ""
    effort_step: str = ""  # largest change of the motor's force within an interval
    error: str = ""  # of the measured position beside its target, lasting


class Sensed(NamedTuple):
    """Readings that must go on to differ while a command moves: one part of a rig."""

    channels: tuple[str, ...]
    moved: str  # the channel that reads what the command is about
    by_effort: bool = False  # whether it is the motor's force that moves them, not the command


class Hysteresis(NamedTuple):
    """A motion and the force that goes with it: what makes a loop."""

    name: str  # what is deformed, in a word: "damper"
    motion: str  # of the measured channels
    force: str  # likewise
    across: str  # what the motion is called on an axis, behind that word: "stroke"
    unit: str = "N"  # of the force where an axis cannot choose it by what is recorded: N or kN


class Pictured(NamedTuple):
    """What pictures and tables call the parts of a laboratory, and which of its signals they put together."""

    system: str  # the transfer system: "actuator"
    name: str  # what that moves, in a word: "column"
    position: str  # what its motion is called, behind that word: "deformation"
    loops: tuple[Hysteresis, ...]
    also: tuple[str, ...] = ()  # measured channels in none of these loops whose histories are shown


def usual(channels: Channels) -> Pictured:
    """What pictures call a laboratory of which they know the signals alone."""
    word = channels.target.name.removesuffix("_target").replace("_", " ")
    across = channels.position.replace("_", " ").removeprefix(f"{word} ")
    loop = Hysteresis(word, channels.position, channels.force, across)
    also = tuple(name for name in channels.names if name not in (loop.motion, loop.force))
    return Pictured(word, word, across, (loop,), also)


class Machine(NamedTuple):
    """A machine in a laboratory, one of its sites, as a diagnosis looks at it."""

    site: str
    parameters: tuple[str, ...]  # nominal ones that may be a little off, as the plan's tolerances name them
    sized: tuple[str, ...]  # channels that tell how large its effects may be, one per unit
    curve: tuple[str, str]  # signals whose relation shows what it does: abscissa and ordinate
    shown: tuple[str, ...] = ()  # channels of which one must be recorded to look for its effects; empty: none
    drive: str = ""  # command without which it stands still; empty: it never does


class Kind(ABC):
    """One kind of laboratory. A kind of a user's is a subclass of `laboratories.device.Device` in a file of its own."""

    name: str
    says: str  # what stands in the laboratory, in a few words
    channels: Channels
    limited: Limited = Limited()
    sensed: tuple[Sensed, ...] = ()
    sites: tuple[str, ...] = ()  # where effects can be, sensors apart
    pictured: Pictured
    reaches: ClassVar[
        Mapping[tuple[str, str], float]
    ] = {}  # channels, or their rates, on the default test, by unit
    responses: tuple[str, ...] = ()  # by which a test's gap is judged; none: `position` and `force`
    free: str = ""  # channel of a motion that nothing may bring back, so that a replay takes it up anew
    record: type[Any]  # NamedTuple of the laboratory at work
    advance: Callable[..., None]  # (record, truth, command, effort): one interval, see `kinds.advance`

    enter: Callable[
        ..., tuple[float, ...]
    ]  # (record as `compiled.plain` gives it, commands...): truth after `advance`

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Its effects beside those in the folders of the catalogue."""
        return ()

    def machines(self, plan: Plan) -> tuple[Machine, ...]:
        """Its machines, one for each of `sites`."""
        channels = self.channels
        curve = (channels.position, channels.force)
        return tuple(Machine(site, (), channels.names, curve) for site in self.sites)

    def planned(self, plan: Plan, name: str) -> Any:
        """The value of a nominal parameter of `machines`."""
        return attrgetter(name)(plan)

    def tolerance(self, plan: Plan, name: str) -> float:
        """How well a nominal parameter is known, relative."""
        return plan.tolerances.parameters.get(name, plan.tolerances.default)

    def scaled(self, system: System, name: str, factor: float) -> System:
        """The system with a nominal parameter multiplied."""
        table, _, key = name.partition(".")
        return system.scaled(table, key, factor)

    def noisy(self, system: System, rms: Mapping[str, float]) -> System:
        """The system with the noise of measured channels replaced."""
        return system.moved("sensors", **rms)

    def settle(self, lab: Any, truth: Array, command: float, interval: float) -> bool:
        """Bring a laboratory at rest to a command (m) that has been there for long; whether its model can be."""
        return False

    def resume(self, lab: Any, truth: Array, motion: float, rate: float) -> None:
        """Take up the motion of `free` (m) with its rate (m/s)."""
        raise NotImplementedError(f"No motion of a laboratory of the kind {self.name} can be taken up anew.")

    def drifts(self, plan: Plan) -> bool:
        """Whether nothing brings the motion of `free` back."""
        return False

    @abstractmethod
    def build(self, system: System) -> Any:
        """The laboratory of a system at rest, as its `record`; raises InputError where it cannot be."""

    @abstractmethod
    def coupling(self, plan: Plan) -> Coupling:
        """Its place in the building of a plan, as `plan.of(role)` shows it to the role that hosts it."""

    @abstractmethod
    def compensator(self, plan: Plan) -> Chosen:
        """The compensator that the plan chooses for it."""

    def noise(self, plan: Plan) -> Array:
        """Nominal rms noise of its measured channels, (channels,), each in its signal's unit, as `[sensors]` has it."""
        return np.array([getattr(plan.sensors, name) for name in self.channels.names])

    def limits(self, plan: Plan) -> Mapping[str, float]:
        """Largest magnitudes by signal, and of those that `limited` names; what is not in it has no limit."""
        return dict(vars(plan.limits))

    @abstractmethod
    def ramp(self, plan: Plan, last: tuple[float, ...], before: tuple[float, ...]) -> Ramp:
        """The way to rest from the last two commands written, in the order of `channels.drives`."""
