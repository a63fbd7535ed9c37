"""How frames get from one process to the others: channels, who hears whom, and the interface of a link."""

from __future__ import annotations

from typing import NamedTuple, Protocol


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
