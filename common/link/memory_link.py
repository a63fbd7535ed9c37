"""A link within one process, for virtual time and for tests: it hands messages over without encoding them."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

from common.host.clock import Waiter
from common.link.endpoint import CHANNELS, Received
from common.link.transport import CONTROL, Route, heard
from common.named import maker
from common.protocol.messages import Message
from common.roles import SLAVE

received = maker(Received)


class MemoryHub:
    """Puts what one role sends into the queues of those that hear it; all must join before the first message.

    `slaves` are the roles of all slaves of the test.
    """

    def __init__(self, slaves: Sequence[str] = (SLAVE,)) -> None:
        self._slaves = slaves
        self._members: dict[str, MemoryEndpoint] = {}

    def join(self, role: str, clock: Waiter) -> MemoryEndpoint:
        """The endpoint of one role, which waits on the clock given."""
        return self._members.setdefault(role, MemoryEndpoint(self, role, clock))

    def hearers(self, role: str, kind: type, to: str) -> list[MemoryEndpoint]:
        """The endpoints that hear a role's messages of a kind, sent to all or to the role `to` alone."""
        route = Route(role, CHANNELS.get(kind, CONTROL), to)
        return [member for hearer, member in self._members.items() if route in heard(hearer, self._slaves)]


class MemoryEndpoint:
    """One role's endpoint at a MemoryHub; `clock` stamps its messages on arrival and lets it wait for them."""

    def __init__(self, hub: MemoryHub, role: str, clock: Waiter) -> None:
        self.clock = clock
        self._hub = hub
        self._role = role
        self._queue: deque[Received] = deque()
        self._hearers: dict[tuple[type, str], list[MemoryEndpoint]] = {}

    def enter(self, session: int) -> None:
        """Do nothing: messages in memory have no key."""

    def expect(self, measured: Mapping[str, int]) -> None:
        """Do nothing: messages in memory arrive as they were sent."""

    def send(self, message: Message, to: str = "") -> int:
        """Put a message into the queue of every role that hears it; returns the present time, ns."""
        route = (type(message), to)
        hearers = self._hearers.get(route)
        if hearers is None:
            hearers = self._hearers[route] = self._hub.hearers(self._role, *route)
        role = self._role
        for hearer in hearers:
            hearer.arrive(message, role)
        return self.clock.now()

    def arrive(self, message: Message, role: str) -> None:
        """Take in a message of a role."""
        now = self.clock.now()
        self._queue.append(received((message, role, now, now)))
        self.clock.wake()

    def receive(self, timeout: float = 0.0) -> Received | None:
        """The next message, waiting at most `timeout` s for it; None where there is none."""
        queue = self._queue
        if not queue and timeout > 0.0:
            self.clock.listen(round(timeout * 1e9))
        return queue.popleft() if queue else None

    def news(self, now_ns: int) -> dict[str, Any] | None:
        """None: without frames none is rejected."""
        return None

    def close(self) -> None:
        """Do nothing: there is no connection to close."""
