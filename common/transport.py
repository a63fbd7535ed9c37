"""How bytes get from one process to the others: the protocol, and a link in memory."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple, Protocol

from common.clock import Clock


class Packet(NamedTuple):
    """One received frame: from which role, on which channel, when (own clock, ns)."""

    role: str
    channel: str
    frame: bytes
    received_ns: int


ROLES = ("master", "slave", "recorder")
TICK, CONTROL, SAMPLES = "tick", "control", "samples"

HEARD: dict[str, tuple[tuple[str, str], ...]] = {
    "master": (("slave", TICK), ("slave", CONTROL), ("recorder", CONTROL)),
    "slave": (("master", TICK), ("master", CONTROL), ("recorder", CONTROL)),
    "recorder": (
        ("master", SAMPLES),
        ("slave", SAMPLES),
        ("master", CONTROL),
        ("slave", CONTROL),
    ),
}


class Transport(Protocol):
    """One process's access to the link."""

    def send(self, channel: str, frame: bytes) -> None:
        """Hand a frame to the link; never blocks."""

    def receive(self, timeout: float) -> Packet | None:
        """The next frame, waiting at most `timeout` s; None where none came."""

    def close(self) -> None:
        """Leave the link."""


class MemoryHub:
    """A link within one process: what one role sends is at once in the queues of those who hear it."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._queues: dict[str, deque[Packet]] = {}

    def join(self, role: str) -> MemoryLink:
        """The access of one role."""
        self._queues[role] = deque()
        return MemoryLink(self, role, self._queues[role])

    def deliver(self, role: str, channel: str, frame: bytes) -> None:
        """Put a frame into the queue of every role that hears it."""
        for hearer, queue in self._queues.items():
            if (role, channel) in HEARD[hearer]:
                queue.append(Packet(role, channel, frame, self._clock.now()))


class MemoryLink:
    """One role's access to a MemoryHub."""

    def __init__(self, hub: MemoryHub, role: str, queue: deque[Packet]) -> None:
        self._hub = hub
        self._role = role
        self._queue = queue

    def send(self, channel: str, frame: bytes) -> None:
        """Deliver a frame at once."""
        self._hub.deliver(self._role, channel, frame)

    def receive(self, timeout: float) -> Packet | None:  # noqa: ARG002 - time stands still in memory
        """The next frame that is there already."""
        return self._queue.popleft() if self._queue else None

    def close(self) -> None:
        """Nothing to leave."""
