"""A link within one process, for virtual time and for tests: messages go from hand to hand."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

from common.host.clock import Waiter
from common.link.endpoint import CHANNELS, Received
from common.link.transport import CONTROL, Route, heard
from common.protocol.messages import Message
from common.roles import SLAVE


class MemoryHub:
    """What one role sends is at once in the queues of those who hear it; all must join before the first message.

    `slaves` are the roles of all slaves of the test.
    """

    def __init__(self, slaves: Sequence[str] = (SLAVE,)) -> None:
        self._slaves = slaves
        self._members: dict[str, MemoryEndpoint] = {}

    def join(self, role: str, clock: Waiter) -> MemoryEndpoint:
        """The access of one role, which waits on a clock of its own."""
        return self._members.setdefault(role, MemoryEndpoint(self, role, clock))

    def hearers(self, role: str, kind: type, to: str) -> list[MemoryEndpoint]:
        """Those who hear a role's messages of a kind, `to` one role alone where it is named."""
        route = Route(role, CHANNELS.get(kind, CONTROL), to)
        return [member for hearer, member in self._members.items() if route in heard(hearer, self._slaves)]


class MemoryEndpoint:
    """One role's access to a MemoryHub; by its `clock` its messages are stamped on arrival, and waited for."""

    def __init__(self, hub: MemoryHub, role: str, clock: Waiter) -> None:
        self.clock = clock
        self._hub = hub
        self._role = role
        self._queue: deque[Received] = deque()
        self._hearers: dict[tuple[type, str], list[MemoryEndpoint]] = {}

    def enter(self, session: int) -> None:
        """Memory needs no key."""

    def expect(self, measured: Mapping[str, int]) -> None:
        """Memory brings what was sent."""

    def send(self, message: Message, to: str = "") -> int:
        """Put a message into the queue of every role that hears it; the present time, ns."""
        route = (type(message), to)
        hearers = self._hearers.get(route)
        if hearers is None:
            hearers = self._hearers[route] = self._hub.hearers(self._role, *route)
        for hearer in hearers:
            hearer.arrive(message, self._role)
        return self.clock.now()

    def arrive(self, message: Message, role: str) -> None:
        """Take in what a role has sent."""
        now = self.clock.now()
        self._queue.append(Received(message, role, now, now))
        self.clock.wake()

    def receive(self, timeout: float = 0.0) -> Received | None:
        """The next message, waiting at most `timeout` s for it; None where there is none."""
        if not self._queue and timeout > 0.0:
            self.clock.listen(round(timeout * 1e9))
        return self._queue.popleft() if self._queue else None

    def news(self, now_ns: int) -> dict[str, Any] | None:
        """Memory carries no frames, so none is rejected."""
        return None

    def close(self) -> None:
        """Nothing to leave."""
