"""A link within one process, for virtual time and for tests: messages go from hand to hand."""

from __future__ import annotations

from collections import deque

from common.clock import Clock
from common.endpoint import CHANNELS, Received
from common.messages import Message
from common.transport import CONTROL, HEARD


class MemoryHub:
    """What one role sends is at once in the queues of those who hear it; all must join before the first message."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self._queues: dict[str, deque[Received]] = {}

    def join(self, role: str) -> MemoryEndpoint:
        """The access of one role."""
        return MemoryEndpoint(self, role, self._queues.setdefault(role, deque()))

    def hearers(self, role: str, kind: type) -> list[deque[Received]]:
        """The queues of those who hear a role's messages of a kind."""
        route = (role, CHANNELS.get(kind, CONTROL))
        return [queue for hearer, queue in self._queues.items() if route in HEARD[hearer]]


class MemoryEndpoint:
    """One role's access to a MemoryHub."""

    def __init__(self, hub: MemoryHub, role: str, queue: deque[Received]) -> None:
        self._hub = hub
        self._role = role
        self._queue = queue
        self._hearers: dict[type, list[deque[Received]]] = {}

    def enter(self, session: int) -> None:
        """Memory needs no key."""

    def send(self, message: Message) -> None:
        """Put a message into the queue of every role that hears it."""
        kind = type(message)
        if kind not in self._hearers:
            self._hearers[kind] = self._hub.hearers(self._role, kind)
        received = Received(message, self._role, self._hub.clock.now())
        for queue in self._hearers[kind]:
            queue.append(received)

    def receive(self, timeout: float = 0.0) -> Received | None:
        """The next message that is there already."""
        return self._queue.popleft() if self._queue else None

    def close(self) -> None:
        """Nothing to leave."""
