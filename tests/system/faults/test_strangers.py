"""Strangers on the master's port: connections that send nothing, and messages larger than any of this system's."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from queue import Queue

import pytest
import zenoh

from common.link.security import Identity
from common.link.transport import CONTROL, Packet, Route
from common.link.zenoh_link import MOST_MESSAGE, ZenohLink, key, listenable
from common.protocol.codec import MOST_FRAME
from tests.certificates import identity, made
from tests.system.faults.hostile import Stranger

WAIT_S = 10.0
TEST = "strangers"


def test_silent_connections_do_not_keep_others_out() -> None:
    endpoint = listenable()
    master = ZenohLink("master", TEST, listen=endpoint)
    try:
        with Stranger(int(endpoint.rpartition(":")[2])).held(300):
            began = time.monotonic()
            ZenohLink("slave", TEST, connect=endpoint, patience=WAIT_S).close()
            assert time.monotonic() - began < WAIT_S / 2  # it is 10 s with zenoh's own bounds
    finally:
        master.close()


def bare(endpoint: str, who: Identity | None) -> zenoh.Session:
    """A session that asks none of our code."""
    config = zenoh.Config()
    settings = {"mode": "client", "connect/endpoints": [endpoint], "scouting/multicast/enabled": False}
    for path, value in (settings | (who.settings() if who else {})).items():
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)


def nobody(_role: str) -> Identity | None:
    """On an open link there are no certificates."""
    return None


@pytest.mark.parametrize("scheme", ["tcp", "tls"])
def test_a_message_larger_than_any_frame_is_not_assembled(scheme: str, tmp_path: Path) -> None:
    who: Callable[[str], Identity | None] = nobody
    if scheme == "tls":
        made(tmp_path / "keys")
        who = lambda role: identity(tmp_path / "keys", role)  # noqa: E731
    endpoint, heard = listenable(), Queue[Packet]()
    master = ZenohLink("master", TEST, listen=endpoint, identity=who("master"))
    master.listen(heard.put)
    session = bare(endpoint.replace("tcp/", f"{scheme}/"), who("slave"))
    try:
        for size in (MOST_FRAME, MOST_MESSAGE, 40_000_000, 1):
            session.put(
                key(TEST, Route("slave", CONTROL)),
                bytes(size),
                congestion_control=zenoh.CongestionControl.BLOCK,
            )
        assert len(heard.get(timeout=WAIT_S).frame) == MOST_FRAME
        assert len(heard.get(timeout=WAIT_S).frame) == 1
    finally:
        session.close()  # type: ignore[no-untyped-call]
        master.close()
