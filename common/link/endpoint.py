"""A process's access to messages: it encodes and decodes them over a transport, and counts rejected frames by reason.

Tables state which role may send which message, and which messages may come under the key that all processes share,
because their sender or receiver does not take part in a session yet.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

from common.host.clock import Clock, MonotonicClock
from common.link.inbox import Inbox
from common.link.rejections import Rejections
from common.link.transport import CHANNELS as CHANNEL_NAMES
from common.link.transport import CONTROL, SAMPLES, TICK, Packet, Transport
from common.protocol import codec
from common.protocol.codec import Reject, RejectedFrame
from common.protocol.messages import (
    Answer,
    Arm,
    Armed,
    Command,
    Extend,
    Feedback,
    Finished,
    Message,
    Operator,
    Recorder,
    Refused,
    Register,
    Registered,
    Resend,
    Samples,
    Scheduled,
    Start,
    Stop,
    Stopped,
    Sync,
    SyncReply,
    Trip,
    Waiting,
)
from common.roles import MASTER, OPERATOR, RECORDER, SLAVE, kind_of

CHANNELS: dict[type, str] = {Command: TICK, Feedback: TICK, Samples: SAMPLES, Finished: SAMPLES}

# Bytes of a frame. A tick's message has at most fourteen numbers of nine bytes and the check; a control message has at
# most three texts of 4000 characters, of four bytes each; a piece of samples is bounded by the codec.
LARGEST = {TICK: 256, CONTROL: 1 << 16, SAMPLES: codec.MOST_FRAME}

SPOKEN: Mapping[str, frozenset[type]] = {
    MASTER: frozenset({Register, Arm, Sync, Start, Command, Stop, Extend, Trip, Answer, Samples, Finished}),
    SLAVE: frozenset(
        {
            Waiting,
            Registered,
            Refused,
            Armed,
            SyncReply,
            Scheduled,
            Feedback,
            Stopped,
            Trip,
            Answer,
            Samples,
            Finished,
        }
    ),
    RECORDER: frozenset({Recorder, Resend}),
    OPERATOR: frozenset({Operator}),
}

# messages that may come under the key that all share
OPEN = frozenset({Register, Waiting, Refused, Arm, Recorder, Operator, Answer})
ALWAYS_OPEN = frozenset(
    {Register, Arm, Operator, Answer}
)  # those always sent under it: a receiver may lack a session
SIGNED = frozenset({Trip, Samples, Finished})  # messages that name their sender in the field `lab`


def channel_of(kind: type) -> str:
    """The channel on which messages of a kind travel."""
    return CHANNELS.get(kind, CONTROL)


# the messages that may come from a kind of role on a channel
ALLOWED: dict[tuple[str, str], frozenset[type]] = {
    (role, channel): frozenset(kind for kind in kinds if channel_of(kind) == channel)
    for role, kinds in SPOKEN.items()
    for channel in CHANNEL_NAMES
}


class Received(NamedTuple):
    """A valid message, the role that sent it, when its frame arrived and when it was decoded (own clock, ns)."""

    message: Message
    role: str = ""
    received_ns: int = 0
    decoded_ns: int = 0


class Endpoint(Protocol):
    """A process's access to the messages of a test."""

    def enter(self, session: int) -> None:
        """Join a session: messages sent from now on belong to it."""

    def expect(self, measured: Mapping[str, int]) -> None:
        """From now on a feedback must have as many measured channels as `measured` gives for its sender's role."""

    def send(self, message: Message, to: str = "") -> int:
        """Hand a message to the link, for all who listen or for the role `to` alone; never blocks.

        Returns when it was encoded, own clock, ns.
        """

    def receive(self, timeout: float = 0.0) -> Received | None:
        """The next message, waiting at most `timeout` s for it; None where there is none."""

    def news(self, now_ns: int) -> dict[str, Any] | None:
        """An event on frames rejected since the last one, at most once a second; None where there is none."""

    def close(self) -> None:
        """Leave the link."""


class FrameEndpoint:
    """Sends and receives the messages of one session as frames over a transport.

    Frames of a session are checked with its key. A control message that is not of the sender's own session, or that
    must be understood without one, is checked with the key that all share; only the messages in `OPEN` are accepted
    under that key.
    """

    def __init__(self, transport: Transport, plan_digest: str, clock: Clock | None = None) -> None:
        self._transport = transport
        self._now = (clock or MonotonicClock()).now
        self._digest = plan_digest
        self._open_key = codec.session_key(0, plan_digest)
        self._place = (0, self._open_key)  # session and its key; replaced as one, read by the link's threads
        self._measured: Mapping[str, int] = {}  # number of channels by role
        self._inbox: Inbox[Received] = Inbox()
        self.rejections = Rejections()
        self.rejected = self.rejections.counts
        transport.listen(self._heard)

    def enter(self, session: int) -> None:
        """Use the key of a session from now on; messages under the key that all share are still understood."""
        self._place = (session, codec.session_key(session, self._digest))

    def expect(self, measured: Mapping[str, int]) -> None:
        """Reject every feedback whose number of measured channels is not that of its role."""
        self._measured = measured

    def send(self, message: Message, to: str = "") -> int:
        """Hand a message to the link; returns when it was encoded, ns."""
        channel = CHANNELS.get(type(message), CONTROL)
        session, key = self._place
        if channel == CONTROL:
            message = codec.fit(message)
            if message.session != session or type(message) in ALWAYS_OPEN:
                key = self._open_key
        frame = codec.encode(message, key)
        encoded_ns = self._now()
        self._transport.send(channel, frame, to)
        return encoded_ns

    def receive(self, timeout: float = 0.0) -> Received | None:
        """The next valid message, waiting at most `timeout` s for it; None where there is none."""
        return self._inbox.get(timeout)

    def news(self, now_ns: int) -> dict[str, Any] | None:
        """An event on frames rejected since the last one, at most once a second; None where there is none."""
        return self.rejections.news(now_ns)

    def _heard(self, packet: Packet) -> None:
        """Decode a frame on the link's own thread, so that the waiting loop is woken by valid messages only."""
        try:
            message = self._decoded(packet)
        except RejectedFrame as rejection:
            self.rejections.add(rejection.reason, packet.role, packet.received_ns)
            return
        self._inbox.put(Received(message, packet.role, packet.received_ns, self._now()))

    def _decoded(self, packet: Packet) -> Message:
        """The message of a frame; raises RejectedFrame if it may not come this way."""
        role, channel, frame, _ = packet
        allowed = ALLOWED.get((kind_of(role), channel), frozenset())
        session, key = self._place
        try:
            message = codec.decode(frame, key, allowed=allowed, largest=LARGEST[channel])
        except RejectedFrame as rejection:
            if rejection.reason is not Reject.CHECK:
                raise
            if not session:
                raise RejectedFrame(Reject.UNREGISTERED) from None
            if channel != CONTROL:
                raise
            message = codec.decode(frame, self._open_key, allowed=allowed, largest=LARGEST[channel])
            check_open(message)
        else:
            if not session:
                check_open(message)
        if channel == TICK:
            if type(message) is Feedback and self._measured.get(role, len(message.measured)) != len(
                message.measured
            ):
                raise RejectedFrame(Reject.FIELDS)
        elif type(message) in SIGNED and message.lab != role:  # type: ignore[union-attr]
            raise RejectedFrame(Reject.SENDER)
        return message

    def close(self) -> None:
        """Leave the link."""
        self._transport.close()


def check_open(message: Message) -> None:
    """Raise RejectedFrame where a message must not come under the key that all share.

    A recorder reports under that key that it is ready; what it reports of a session comes under the session's key.
    """
    if type(message) not in OPEN or (isinstance(message, Recorder) and message.session):
        raise RejectedFrame(Reject.OPEN_KEY)
