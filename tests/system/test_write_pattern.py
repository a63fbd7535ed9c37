"""One write per frame over TCP: a second one that waits for an acknowledgement would cost 40 ms an exchange.

With Nagle's algorithm a small segment waits until the one before it is acknowledged, and the other side delays its
acknowledgement while it has nothing to send: write, write, read takes 40 ms and more (Cheshire, "TCP Performance
problems caused by interaction between Nagle's Algorithm and Delayed ACK", 2005).
"""

from __future__ import annotations

import contextlib
import selectors
import socket
import statistics
import threading
import time
from collections.abc import Iterator

import pytest

from common.link.endpoint import FrameEndpoint
from common.link.zenoh_link import ZenohLink, listenable
from common.protocol.messages import Command, Feedback, Message
from tests.processes import HANG_S

SESSION, DIGEST = 1, "plan"
EXCHANGES = 60
DELAYED_ACK_S = 0.02  # half of what a delayed acknowledgement costs, a hundred times what an exchange does
COMMAND = Command(SESSION, 0, 0, 0, -1, 0.0, 0.0, 0.0, 0.0, 0.0)
FEEDBACK = Feedback(SESSION, 0, 0, 0, 0, 0, 0, 0, (0.0, 0.0, 0.0, 0.0))


class Relay:
    """Hands bytes on between a dialler and a listener, and counts the pieces in which they came, by direction."""

    def __init__(self, to: int) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._server.getsockname()[1]
        self._to = to
        self.pieces = {"there": 0, "back": 0}
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def _work(self) -> None:
        with self._server:
            dialler, _ = self._server.accept()
        listener = socket.create_connection(("127.0.0.1", self._to))
        ways = {dialler: (listener, "back"), listener: (dialler, "there")}
        with selectors.DefaultSelector() as selector, dialler, listener:
            for end in ways:
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                selector.register(end, selectors.EVENT_READ)
            while True:
                for event, _ in selector.select():
                    assert isinstance(event.fileobj, socket.socket)
                    other, way = ways[event.fileobj]
                    data = event.fileobj.recv(65536)
                    if not data:
                        return
                    self.pieces[way] += 1
                    with contextlib.suppress(OSError):
                        other.sendall(data)


@pytest.fixture
def ends() -> Iterator[tuple[FrameEndpoint, FrameEndpoint, Relay]]:
    """Master's and slave's endpoint over zenoh, and the relay between them."""
    listen = listenable()
    master = ZenohLink("master", "pattern", listen=listen)
    relay = Relay(int(listen.rpartition(":")[2]))
    slave = ZenohLink("slave", "pattern", connect=f"tcp/127.0.0.1:{relay.port}", patience=10.0)
    endpoints = FrameEndpoint(master, DIGEST), FrameEndpoint(slave, DIGEST)
    for endpoint in endpoints:
        endpoint.enter(SESSION)
    yield (*endpoints, relay)
    slave.close()
    master.close()


def heard(endpoint: FrameEndpoint, kind: type, seconds: float) -> bool:
    """Whether a message of a kind comes in time."""
    deadline = time.monotonic() + seconds
    while (left := deadline - time.monotonic()) > 0.0:
        received = endpoint.receive(left)
        if received is not None and isinstance(received.message, kind):
            return True
    return False


def exchange(asking: FrameEndpoint, answering: FrameEndpoint, seq: int) -> float:
    """Seconds of a command and its feedback, one after the other in one thread."""
    began = time.monotonic()
    there: Message = COMMAND._replace(seq=seq)
    asking.send(there)
    assert heard(answering, Command, 5.0)
    answering.send(FEEDBACK._replace(seq=seq))
    assert heard(asking, Feedback, 5.0)
    return time.monotonic() - began


def test_a_frame_is_one_write_and_does_not_wait_for_an_acknowledgement(
    ends: tuple[FrameEndpoint, FrameEndpoint, Relay],
) -> None:
    master, slave, relay = ends
    deadline = time.monotonic() + HANG_S
    while time.monotonic() < deadline:  # until both know of each other
        master.send(COMMAND)
        if heard(slave, Command, 0.1):
            break
    while heard(slave, Command, 0.1):
        pass
    before = dict(relay.pieces)
    seconds = [exchange(master, slave, seq) for seq in range(EXCHANGES)]
    assert statistics.median(seconds) < DELAYED_ACK_S
    for way, count in relay.pieces.items():
        assert EXCHANGES <= count - before[way] <= EXCHANGES + 10, (
            way
        )  # and a few of zenoh's own to keep alive


def write_write_read(count: int) -> list[float]:
    """Seconds of exchanges whose request is written in two pieces over a socket as it comes."""
    server = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        peer, _ = server.accept()
        with peer:
            while len(peer.recv(2, socket.MSG_WAITALL)) == 2:
                peer.sendall(b"ok")

    threading.Thread(target=serve, daemon=True).start()
    found = []
    with socket.create_connection(server.getsockname(), timeout=10.0) as asking:
        for _ in range(count):
            began = time.monotonic()
            asking.sendall(b"a")
            asking.sendall(b"b")
            asking.recv(2, socket.MSG_WAITALL)
            found.append(time.monotonic() - began)
    server.close()
    return found


def test_the_limit_detects_the_write_write_read_pattern() -> None:
    # the first exchanges of a connection are acknowledged at once
    assert statistics.median(write_write_read(40)[20:]) > DELAYED_ACK_S
