"""The interface of a kind of laboratory: its channels, its coupling to the building, its model, its ramp to rest.

All kinds are driven in the same way. At each tick a laboratory gets a target for the interval's end with the target's
rates, and a force for its motor where it has one. Its compensator computes a command from them, which its transfer
system follows. Its measurements go back to the master, and one of the measured forces enters the equation of motion.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
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
    """The motion of the building that a laboratory follows, and so how its force acts on the building."""

    DRIFT = "drift"  # of a storey; the force resists it, between the storey's two floors
    FLOOR = "floor"  # absolute displacement of a floor; the force pushes that floor


class Coupling(NamedTuple):
    """The coupling of a laboratory to the building of a plan."""

    follows: Follows
    place: int  # storey or floor, from 1
    ratio: float  # target over that motion
    scale: float  # force on the building over force measured
    effort: (
        float  # motor's force in the laboratory over the velocity of floor or drift, N·s/m; 0 without a motor
    )
    correction: ForceCorrection  # of the measured force before it enters the equation of motion
    stiffness: float  # nominal stiffness against that motion, at the building's scale, N/m; 0 for none
    damping: float  # nominal dashpot, likewise, N·s/m
    mass: float  # nominal mass, likewise, kg
    share: float  # of the storey's columns, which the specimen represents


class Chosen(NamedTuple):
    """The compensator that a plan chooses for a laboratory."""

    kind: str
    parameters: Mapping[str, float]
    where: str  # table of the plan's file, for messages about it


class Limited(NamedTuple):
    """The names of the limits on the changes of a laboratory's command, empty for none."""

    step: str = ""  # largest change of the command within an interval
    velocity: str = ""
    acceleration: str = ""
    effort_step: str = ""  # largest change of the motor's force within an interval
    error: str = ""  # lasting error of the measured position relative to its target


class Sensed(NamedTuple):
    """Readings of one part of a rig that must keep changing while a command moves; otherwise a sensor is frozen."""

    channels: tuple[str, ...]
    moved: str  # the channel that measures the commanded quantity
    by_effort: bool = False  # whether the motor's force moves them rather than the transfer system's command


class Hysteresis(NamedTuple):
    """A motion and its force, which together show a hysteresis loop."""

    name: str  # name of the deformed part: "damper"
    motion: str  # of the measured channels
    force: str  # likewise
    across: str  # name of the motion on an axis, after that of the part: "stroke"
    unit: str = "N"  # of the force on an axis whose unit does not follow from the recorded values: N or kN


class Pictured(NamedTuple):
    """The names of a laboratory's parts in pictures and tables, and the signals that they combine."""

    system: str  # the transfer system: "actuator"
    name: str  # the part that it moves: "column"
    position: str  # name of that part's motion: "deformation"
    loops: tuple[Hysteresis, ...]
    also: tuple[str, ...] = ()  # further measured channels whose histories are shown


def usual(channels: Channels) -> Pictured:
    """The names for pictures of a laboratory by its channels alone."""
    word = channels.target.name.removesuffix("_target").replace("_", " ")
    across = channels.position.replace("_", " ").removeprefix(f"{word} ")
    loop = Hysteresis(word, channels.position, channels.force, across)
    also = tuple(name for name in channels.names if name not in (loop.motion, loop.force))
    return Pictured(word, word, across, (loop,), also)


class Machine(NamedTuple):
    """A machine in a laboratory, which is one of its sites, as a diagnosis treats it."""

    site: str
    parameters: tuple[str, ...]  # nominal parameters with a tolerance, as the plan's tolerances name them
    sized: tuple[str, ...]  # channels from which the magnitudes of its effects follow, one per unit
    curve: tuple[str, str]  # signals whose relation characterises it: abscissa and ordinate
    shown: tuple[
        str, ...
    ] = ()  # channels of which one must be recorded for a search of its effects; empty: none
    drive: str = ""  # command without which it does not move; empty: it always moves


class Moving(NamedTuple):
    """The motion of a laboratory whose transfer system is to be brought to a standstill."""

    velocity: float  # of its target, m/s
    effort: float  # commanded force of its motor, N
    measured: tuple[float, ...]
    rates: tuple[float, ...]  # of the measured channels, per s
    duration: float  # of the ramp to standstill, s


class Coasting(NamedTuple):
    """What a laboratory goes on doing when its transfer system stands still."""

    channel: str  # measured channel that moves farthest compared with its limit, empty for none
    peak: float  # largest magnitude that it reaches
    energy: float  # of the motion and of the work at that rate that the building then lacks, J at its scale


class Kind(ABC):
    """One kind of laboratory. A kind of a user's is a subclass of `laboratories.device.Device` in a file of its own."""

    name: str
    says: str  # a short text on the devices in the laboratory
    channels: Channels
    limited: Limited = Limited()
    sensed: tuple[Sensed, ...] = ()
    sites: tuple[str, ...] = ()  # sites of effects, without the sensors
    pictured: Pictured
    reaches: ClassVar[Mapping[tuple[str, str], float]] = {}  # peaks on the default test, by channel and unit
    responses: tuple[str, ...] = ()  # channels by which a test's gap is judged; none: `position` and `force`
    free: str = ""  # channel of a motion without restoring force, which a replay therefore restarts
    record: type[Any]  # NamedTuple of the laboratory's state and constants
    advance: Callable[..., None]  # (record, truth, command, effort): one interval, see `kinds.advance`

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Its effects in addition to those in the folders of the catalogue."""
        return ()

    @abstractmethod
    def mover(self, lab: Any) -> Callable[..., tuple[float, ...]]:
        """`advance` of a laboratory for a caller outside compiled code: takes its commands, gives the truth."""

    def machines(self, plan: Plan) -> tuple[Machine, ...]:
        """Its machines, one for each of `sites`."""
        channels = self.channels
        curve = (channels.position, channels.force)
        return tuple(Machine(site, (), channels.names, curve) for site in self.sites)

    def planned(self, plan: Plan, name: str) -> Any:
        """The value of a nominal parameter of `machines`."""
        return attrgetter(name)(plan)

    def tolerance(self, plan: Plan, name: str) -> float:
        """The relative tolerance of a nominal parameter."""
        return plan.tolerances.parameters.get(name, plan.tolerances.default)

    def scaled(self, system: System, name: str, factor: float) -> System:
        """The system with a nominal parameter multiplied."""
        table, _, key = name.partition(".")
        return system.scaled(table, key, factor)

    def between_ticks(self, system: System, drive: Array, places: Sequence[float | None]) -> Array | float:
        """Means of the readings around each tick, less those of straight lines between ticks, (ticks, channels).

        Of a channel with a place, from 0 at a tick to 1 at the next one, it is what the reading itself has there.

        Zero where readings are straight enough. `drive` (ticks, 2) holds the transfer system's command (m), in straight
        lines between ticks, and a motor's (N), held between them. A logger's filter, which averages over several ticks,
        shows these means, and a delay by a part of an interval shows a place.
        """
        return 0.0

    def noisy(self, system: System, rms: Mapping[str, float]) -> System:
        """The system with the noise of measured channels replaced."""
        return system.moved("sensors", **rms)

    def settle(self, lab: Any, truth: Array, command: float, interval: float) -> bool:
        """Bring a laboratory at rest to the steady state of a constant command (m).

        False if the model does not support it.
        """
        return False

    def resume(self, lab: Any, truth: Array, motion: float, rate: float) -> None:
        """Set the motion of `free` (m) and its rate (m/s)."""
        raise NotImplementedError(f"The kind {self.name} has no motion that can be set.")

    def drifts(self, plan: Plan) -> bool:
        """Whether the motion of `free` has no restoring force."""
        return False

    def decay(self, plan: Plan) -> float:
        """The rate (1/s) at which a motion of `free` without a restoring force becomes slower by itself."""
        return 0.0

    @abstractmethod
    def build(self, system: System) -> Any:
        """The laboratory of a system at rest, as its `record`.

        Raises InputError where parameters or effects are not valid.
        """

    @abstractmethod
    def coupling(self, plan: Plan) -> Coupling:
        """Its coupling to the building of a plan; `plan` as the role that hosts it sees it."""

    @abstractmethod
    def compensator(self, plan: Plan) -> Chosen:
        """The compensator that the plan chooses for it."""

    def noise(self, plan: Plan) -> Array:
        """Nominal rms noise of its measured channels, (channels,), each in its signal's unit, from `[sensors]`."""
        return np.array([getattr(plan.sensors, name) for name in self.channels.names])

    def limits(self, plan: Plan) -> Mapping[str, float]:
        """Largest magnitudes by signal, and by the names in `limited`; a signal that is not in it has no limit."""
        return dict(vars(plan.limits))

    def coasting(self, plan: Plan, moving: Moving) -> Coasting | None:
        """What it goes on doing when its transfer system is brought to a standstill; None where that is not known.

        A specimen between two floors comes to rest with its transfer system. What it lacks then is the work of its
        nominal dashpot over the ramp and the kinetic energy of its nominal mass. A device on a floor moves on its own,
        and only its kind knows how.
        """
        coupling = self.coupling(plan)
        if coupling.follows is not Follows.DRIFT:
            return None
        rate = moving.velocity / coupling.ratio
        energy = rate**2 * (coupling.damping * moving.duration + 0.5 * coupling.mass)
        return Coasting("", 0.0, energy)

    @abstractmethod
    def ramp(self, plan: Plan, last: tuple[float, ...], before: tuple[float, ...]) -> Ramp:
        """The ramp to rest from the last two commands written, in the order of `channels.drives`."""
