"""A process's access to messages; over a transport by the codec, with rejected frames counted by reason."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple, Protocol

from common import codec
from common.clock import MonotonicClock
from common.messages import Command, Feedback, Finished, Message, Samples
from common.transport import CONTROL, SAMPLES, TICK, Transport

CHANNELS: dict[type, str] = {Command: TICK, Feedback: TICK, Samples: SAMPLES, Finished: SAMPLES}


class Received(NamedTuple):
    """A valid message, from whom, and when it arrived (own clock, ns)."""

    message: Message
    role: str
    received_ns: int


class Endpoint(Protocol):
    """A process's access to the messages of a test."""

    def enter(self, session: int) -> None:
        """Take part in a session: what is sent from now on belongs to it."""

    def send(self, message: Message) -> int:
        """Hand a message to the link; never blocks. When it was encoded and handed over, own clock, ns."""

    def receive(self, timeout: float = 0.0) -> Received | None:
        """The next message, waiting at most `timeout` s for it; None where there is none."""

    def close(self) -> None:
        """Leave the link."""


class FrameEndpoint:
    """Sends and receives the messages of one session as frames over a transport."""

    def __init__(self, transport: Transport, plan_digest: str) -> None:
        self._transport = transport
        self._clock = MonotonicClock()
        self._digest = plan_digest
        self._open_key = codec.session_key(0, plan_digest)
        self._key = self._open_key
        self.rejected: Counter[str] = Counter()

    def enter(self, session: int) -> None:
        """Use the key of a session for what is sent from now on; frames before it are still understood."""
        self._key = codec.session_key(session, self._digest)

    def send(self, message: Message) -> int:
        """Hand a message to the link; when it was encoded, ns."""
        channel = CHANNELS.get(type(message), CONTROL)
        key = self._key if channel != CONTROL else self._open_key
        frame = codec.encode(message, key)
        encoded_ns = self._clock.now()
        self._transport.send(channel, frame)
        return encoded_ns

    def receive(self, timeout: float = 0.0) -> Received | None:
        """The next valid message, waiting at most `timeout` s for a frame; None where there is none."""
        while True:
            packet = self._transport.receive(timeout)
            if packet is None:
                return None
            key = self._key if packet.channel != CONTROL else self._open_key
            try:
                return Received(codec.decode(packet.frame, key), packet.role, packet.received_ns)
            except codec.RejectedFrame as rejection:
                self.rejected[rejection.reason.value] += 1

    def close(self) -> None:
        """Leave the link."""
        self._transport.close()
