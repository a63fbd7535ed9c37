"""Links with certificates, their ears, and bare sessions beside them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from queue import Empty, Queue
from typing import Any

import zenoh

from common.link.security import Identity
from common.link.transport import CONTROL, TICK, Packet
from common.link.zenoh_link import ZenohLink, listenable
from tests.certificates import identity
from tests.processes import HANG_S

TEST = "secure"
PATIENCE_S = 10.0  # of a link, for its partners to join


class Ear:
    """One role's link, and what it has heard."""

    def __init__(self, role: str, who: Identity | None, **words: Any) -> None:
        self.packets: Queue[Packet] = Queue()
        self.link = ZenohLink(role, TEST, identity=who, patience=words.pop("patience", PATIENCE_S), **words)
        self.link.listen(self.packets.put)

    def next(self, seconds: float = HANG_S) -> tuple[str, str, bytes] | None:
        try:
            packet = self.packets.get(timeout=seconds)
        except Empty:
            return None
        return packet.role, packet.channel, packet.frame

    def until(self, frame: bytes) -> list[bytes]:
        """What comes before a frame."""
        found: list[bytes] = []
        while (heard := self.next()) is not None:
            if heard[2] == frame:
                return found
            found.append(heard[2])
        raise TimeoutError(f"{frame!r} never came")


@contextmanager
def ears(folder: Path, *roles: str) -> Iterator[dict[str, Ear]]:
    """A master and others on a link with certificates, who know of each other's subscriptions."""
    endpoint = listenable()
    with ExitStack() as stack:
        found: dict[str, Ear] = {}
        for role in ("master", *roles):
            place = {"listen": endpoint} if role == "master" else {"connect": endpoint}
            found[role] = Ear(role, identity(folder, role), **place)
            stack.callback(found[role].link.close)
        found["master"].endpoint = endpoint  # type: ignore[attr-defined]
        acquaint(found)
        yield found


def acquaint(found: dict[str, Ear]) -> None:
    """Send until everybody is heard: subscriptions take their time."""
    for speaker, hearer in (("master", "slave"), ("slave", "master"), ("recorder", "slave")):
        if speaker in found and hearer in found:
            channel = CONTROL if speaker == "recorder" else TICK
            for _ in range(200):
                found[speaker].link.send(channel, b"hello")
                if found[hearer].next(0.05) is not None:
                    break
    for ear in found.values():
        while ear.next(0.1) is not None:
            pass


@contextmanager
def bare(endpoint: str, who: Identity | None, mode: str = "client") -> Iterator[zenoh.Session]:
    """A session that asks none of our code, over TLS."""
    config = zenoh.Config()
    settings: dict[str, object] = {
        "mode": mode,
        "connect/endpoints": [endpoint.replace("tcp/", "tls/")],
        "connect/timeout_ms": 1000,
        "connect/exit_on_failure": True,
        "listen/endpoints": [],
        "scouting/multicast/enabled": False,
    }
    if who is not None:
        settings |= who.settings()
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))
    session = zenoh.open(config)
    try:
        yield session
    finally:
        session.close()  # type: ignore[no-untyped-call]


# -- those who have the right certificate ------------------------------------------------------------
