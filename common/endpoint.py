"""A process's access to messages; over a transport by the codec, with rejected frames counted by reason."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple, Protocol

from common import codec
from common.clock import MonotonicClock
from common.inbox import Inbox
from common.messages import Command, Feedback, Finished, Message, Samples
from common.transport import CONTROL, SAMPLES, TICK, Packet, Transport

CHANNELS: dict[type, str] = {Command: TICK, Feedback: TICK, Samples: SAMPLES, Finished: SAMPLES}


class Received(NamedTuple):
    """A valid message, from whom, when its frame arrived and when it was decoded (own clock, ns)."""

    message: Message
    role: str = ""
    received_ns: int = 0
    decoded_ns: int = 0


class Endpoint(Protocol):
    """A process's access to the messages of a test."""

    def enter(self, session: int) -> None:
        """Take part in a session: what is sent from now on belongs to it."""

    def send(self, message: Message, to: str = "") -> int:
        """Hand a message to the link, `to` one role alone where it is named; never blocks.

        When it was encoded and handed over, own clock, ns.
        """

    def receive(self, timeout: float = 0.0) -> Received | None:
        """The next message, waiting at most `timeout` s for it; None where there is none."""

    def close(self) -> None:
        """Leave the link."""


class FrameEndpoint:
    """Sends and receives the messages of one session as frames over a transport."""

    def __init__(self, transport: Transport, plan_digest: str) -> None:
        self._transport = transport
        self._now = MonotonicClock().now
        self._digest = plan_digest
        self._open_key = codec.session_key(0, plan_digest)
        self._key = self._open_key
        self._inbox: Inbox[Received] = Inbox()
        self.rejected: Counter[str] = Counter()
        transport.listen(self._heard)

    def enter(self, session: int) -> None:
        """Use the key of a session for what is sent from now on; frames before it are still understood."""
        self._key = codec.session_key(session, self._digest)

    def send(self, message: Message, to: str = "") -> int:
        """Hand a message to the link; when it was encoded, ns."""
        channel = CHANNELS.get(type(message), CONTROL)
        key = self._key if channel != CONTROL else self._open_key
        frame = codec.encode(message, key)
        encoded_ns = self._now()
        self._transport.send(channel, frame, to)
        return encoded_ns

    def receive(self, timeout: float = 0.0) -> Received | None:
        """The next valid message, waiting at most `timeout` s for it; None where there is none."""
        return self._inbox.get(timeout)

    def _heard(self, packet: Packet) -> None:
        """Decode a frame on the link's own thread, which is awake: whoever waits is woken by a message."""
        key = self._key if packet.channel != CONTROL else self._open_key
        try:
            message = codec.decode(packet.frame, key)
        except codec.RejectedFrame as rejection:
            self.rejected[rejection.reason.value] += 1
            return
        self._inbox.put(Received(message, packet.role, packet.received_ns, self._now()))

    def close(self) -> None:
        """Leave the link."""
        self._transport.close()
