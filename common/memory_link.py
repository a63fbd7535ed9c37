"""A link within one process, for virtual time and for tests: messages go from hand to hand."""

from __future__ import annotations

from collections import deque

from common.clock import Clock
from common.endpoint import CHANNELS, Received
from common.messages import Message
from common.transport import CONTROL, HEARD


class MemoryHub:
    """What one role sends is at once in the queues of those who hear it."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._queues: dict[str, deque[Received]] = {}
        self._hearers: dict[tuple[str, str], list[deque[Received]]] = {}

    def join(self, role: str) -> MemoryEndpoint:
        """The access of one role."""
        queue = self._queues.setdefault(role, deque())
        for route in HEARD[role]:
            self._hearers.setdefault(route, []).append(queue)
        return MemoryEndpoint(self, role, queue)

    def deliver(self, role: str, message: Message) -> None:
        """Put a message into the queue of every role that hears it."""
        for queue in self._hearers.get((role, CHANNELS.get(type(message), CONTROL)), ()):
            queue.append(Received(message, role, self._clock.now()))


class MemoryEndpoint:
    """One role's access to a MemoryHub."""

    def __init__(self, hub: MemoryHub, role: str, queue: deque[Received]) -> None:
        self._hub = hub
        self._role = role
        self._queue = queue

    def enter(self, session: int) -> None:
        """Memory needs no key."""

    def send(self, message: Message) -> None:
        """Deliver a message at once."""
        self._hub.deliver(self._role, message)

    def receive(self, timeout: float = 0.0) -> Received | None:
        """The next message that is there already."""
        return self._queue.popleft() if self._queue else None

    def close(self) -> None:
        """Nothing to leave."""
