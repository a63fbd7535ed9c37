"""An endpoint that receives the frames which a test hands to it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from common.link.endpoint import FrameEndpoint
from common.link.transport import Packet
from common.protocol.codec import encode
from common.protocol.messages import (
    Feedback,
    Message,
)
from tests.common.test_codec import COMMAND, KEY

SESSION = 7
FEEDBACK = Feedback(SESSION, 3, 2, 11, 2, 11, 12, 13, (0.001, 0.1, 0.002, 12.5))


class Wire:
    """Stands in for a link: its frames are those that a test hands to `hear`."""

    def __init__(self) -> None:
        self.hear: Callable[[Packet], None] = lambda _: None
        self.sent: list[tuple[str, bytes]] = []

    def send(self, channel: str, frame: bytes, to: str = "") -> None:
        self.sent.append((channel, frame))

    def listen(self, heard: Callable[[Packet], None]) -> None:
        self.hear = heard

    def close(self) -> None:
        pass


class End(NamedTuple):
    """An endpoint and the link from which it receives."""

    endpoint: FrameEndpoint
    wire: Wire

    def hears(self, role: str, channel: str, frame: bytes, at: int = 1) -> Message | None:
        """The message that the endpoint decodes from a frame, None where it rejects the frame."""
        self.wire.hear(Packet(role, channel, frame, at))
        received = self.endpoint.receive()
        return received.message if received else None


def end(session: int = SESSION) -> End:
    wire = Wire()
    endpoint = FrameEndpoint(wire, "plan")
    endpoint.enter(session)
    return End(endpoint, wire)


GOOD = encode(COMMAND, KEY)
