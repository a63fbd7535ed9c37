"""The building as the master's loop sees it: computed here, or by a client that asks for displacements."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from common.lab.laboratory import Laboratory
from common.protocol.messages import Feedback
from common.safety.watchdog import WatchdogFinding
from common.signals import OF_STOREYS

Sent = tuple[float, ...]  # target m, motor force N, and the rates of the target m/s, m/s², m/s³


class Outputs(NamedTuple):
    """What a tick computes: the building and the targets at t_k, and the commands for the interval's end.

    Of a master without a laboratory target, command and effort are zero.
    """

    ground_acceleration: float
    target: float  # of its own laboratory at t_k, m
    command: float  # of its transfer system, m
    effort: float  # of its motor, N
    sent: Sequence[Sent]  # to each slave, in the plan's order
    storeys: list[
        float
    ]  # of each signal of the storeys in turn (`common.signals.OF_STOREYS`) the value of every one
    held: bool = False  # whether nothing new is wanted: every laboratory keeps the command that it has

    @property
    def of_storeys(self) -> dict[str, list[float]]:
        """The values of every storey by signal."""
        n = len(self.storeys) // len(OF_STOREYS)
        return {name: self.storeys[place * n : (place + 1) * n] for place, name in enumerate(OF_STOREYS)}


class Answering(Protocol):
    """A slave as a building sees it."""

    used: Feedback  # the newest that has come
    position: int  # place of its position (m) among what it measures


class Building:
    """Whoever moves the laboratories: from what they measured at a tick to what they do in the coming interval."""

    def join(self, lab: Laboratory, partners: Sequence[Answering]) -> None:
        """Know the master's clock and the slaves, before the handshake."""

    @property
    def awaited(self) -> str:
        """Who has to come before the laboratories arm, empty where all that is needed is there."""
        return ""

    def look_after(self) -> None:
        """Serve those who have come, while nothing moves."""

    def __call__(self, tick: int, position: float, force: float, forces: Sequence[float]) -> Outputs:
        """One tick, from the master's own position (m) and force (N) as measured and each slave's force (N).

        Raises:
            InterlockError, LostError: it cannot go on.
        """
        raise NotImplementedError

    def written(self, tick: int) -> None:
        """The tick's commands are out; there is time until the next one."""

    @property
    def over(self) -> bool:
        """Whether it wants the test to end in order."""
        return False

    def look(self, tick: int) -> WatchdogFinding:
        """The watchdog's finding on it at a tick that came in time."""
        return WatchdogFinding.FINE

    def recorded(self, outputs: Outputs) -> tuple[Sequence[float], Sequence[float]]:
        """What stands of it in a row of the recording: before the master's own laboratory, and behind it."""
        raise NotImplementedError

    def leave(self) -> None:
        """The test is over."""
