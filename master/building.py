"""The interface of the building for the master's loop: computed by the master or by a client."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from common.earthquake_time import EarthquakeTime
from common.lab.laboratory import Laboratory
from common.protocol.messages import Feedback
from common.roles import CLIENT
from common.safety.watchdog import FINE, WatchdogFinding
from common.signals import OF_STOREYS

Sent = tuple[float, ...]  # target m, motor force N, and the rates of the target m/s, m/s², m/s³


class Outputs(NamedTuple):
    """The results of a tick: the building and the target at t_k, and the commands for the end of the interval.

    For a master without a laboratory target, command and effort are zero.
    """

    ground_acceleration: float
    target: float  # of its own laboratory at t_k, m
    command: float  # of its transfer system, m
    effort: float  # of its motor, N
    sent: Sequence[Sent]  # to each slave, in the plan's order
    storeys: Sequence[float]  # signal by signal (`common.signals.OF_STOREYS`) the values of all storeys
    held: bool = False  # whether every laboratory keeps its present command
    rate: float = 1.0  # at which the earthquake's time passes, below 1 around a hold

    @property
    def of_storeys(self) -> dict[str, Sequence[float]]:
        """The values of every storey by signal."""
        n = len(self.storeys) // len(OF_STOREYS)
        return {name: self.storeys[place * n : (place + 1) * n] for place, name in enumerate(OF_STOREYS)}


class Answering(Protocol):
    """The part of a slave that a building uses."""

    used: Feedback  # the latest one received
    position: int  # index of its position (m) in its measurements


class BuildingStep:
    """Computes from the measurements of a tick what the laboratories do in the coming interval."""

    who = CLIENT  # in messages, and the code of the event that says why it cannot continue
    time: EarthquakeTime | None = None  # of a building that can be held
    unheld = "its building is computed by another program, whose time goes on"  # why it cannot, if so

    def join(self, lab: Laboratory, partners: Sequence[Answering]) -> None:
        """Receive the master's laboratory, with its clock, and the slaves; called before the handshake."""

    @property
    def awaited(self) -> str:
        """Name of the program that must connect before the laboratories arm; empty if none is missing."""
        return ""

    def look_after(self) -> None:
        """Serve connected programs while nothing moves."""

    def __call__(self, tick: int, position: float, force: float, forces: Sequence[float]) -> Outputs:
        """Compute a tick from the measured position (m) and force (N) of the master's rig and the slaves' forces (N).

        Raises:
            InterlockError, LostError: the building cannot continue.
        """
        raise NotImplementedError

    def hold(self, tick: int) -> None:
        """Let the earthquake's time slow down to standstill from a tick on; only where there is a `time`."""
        raise NotImplementedError

    @property
    def told(self) -> Sent:
        """The values for the master's own laboratory at the end of the interval; only where there is a `time`."""
        raise NotImplementedError

    def written(self, tick: int) -> None:
        """Use the time until the next tick; called when the commands of a tick have been sent."""

    @property
    def over(self) -> bool:
        """Whether the building requests an orderly end of the test."""
        return False

    def look(self, tick: int) -> WatchdogFinding:
        """The watchdog's finding on the building, at a tick that is not late."""
        return FINE

    def recorded(self, outputs: Outputs) -> tuple[Sequence[float], Sequence[float]]:
        """Its values in a row of the recording: those before and those after the values of the master's laboratory.

        They are the ground and the storeys' motion, then their numerical forces.
        """
        forces = len(outputs.storeys) - len(outputs.storeys) // len(OF_STOREYS)
        return (outputs.ground_acceleration, *outputs.storeys[:forces]), outputs.storeys[forces:]

    def leave(self) -> None:
        """Close connections; called when the test has ended."""
