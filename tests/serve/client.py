"""Clients of `rths serve` written from the protocol: one that integrates a storey, and scripted ones."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Sequence

from common.opensees import wire
from common.opensees.wire import ClientHeader, MessageCode, Quantities, Sizes

HOST = "127.0.0.1"
FRESCO = ClientHeader(Sizes(displacement=1), Sizes(displacement=1, force=1, time=1), 256)
PATIENCE_S = 200.0  # s, for what may hang; it ends in well under a second


def free_port() -> int:
    """A port that nobody uses."""
    with socket.create_server((HOST, 0)) as server:
        return int(server.getsockname()[1])


class Element:
    """The socket protocol of a `genericClient` element of OpenSees."""

    def __init__(self, port: int, header: ClientHeader | None = None) -> None:
        self.header = header or wire.element(1)
        end = time.monotonic() + PATIENCE_S
        while True:
            self.socket = socket.socket()
            if not self.socket.connect_ex((HOST, port)):
                break
            self.socket.close()
            if time.monotonic() > end:
                raise TimeoutError("nobody serves")
            time.sleep(0.02)
        self.socket.settimeout(PATIENCE_S)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.raw(wire.header_bytes(self.header))

    def raw(self, data: bytes) -> None:
        """Send some bytes."""
        self.socket.sendall(data)

    def say(self, code: MessageCode, places: Sequence[float] = (), t: float = 0.0) -> None:
        """Send a message."""
        sizes = self.header.control
        zeros = (0.0,) * sizes.displacement
        values = Quantities(
            tuple(places) or zeros,
            zeros[: sizes.velocity],
            zeros[: sizes.acceleration],
            (),
            (t,) * sizes.time,
        )
        self.raw(wire.message(self.header, code, values))

    def answer(self, count: int) -> tuple[float, ...]:
        """The next answer; raises ConnectionError where there is none."""
        data = b""
        while len(data) < self.header.size:
            piece = self.socket.recv(self.header.size - len(data))
            if not piece:
                raise ConnectionError("the server has closed the connection")
            data += piece
            if hasattr(socket, "TCP_QUICKACK"):
                self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
        return wire.numbers_in(self.header, data, count)

    def step(self, places: Sequence[float], t: float = 0.0) -> tuple[float, ...]:
        """One step as NewmarkExplicit makes it: the forces (N) at displacements (m)."""
        n = len(places)
        self.say(MessageCode.TRIAL, places, t)
        self.say(MessageCode.DAMPING)
        self.answer(n * n)
        self.say(MessageCode.FORCE, places, t)
        forces = self.answer(n)
        self.say(MessageCode.DAMPING)
        self.answer(n * n)
        self.say(MessageCode.TRIAL, places, t)
        self.say(MessageCode.COMMIT, places, t)
        return forces

    def steps(self, count: int, dt: float = 0.002, dofs: int = 1) -> list[tuple[float, ...]]:
        """Some steps on a ramp of 0.1 mm each."""
        return [self.step([1e-4 * (i + 1)] * dofs, dt * (i + 1)) for i in range(count)]

    def close(self) -> None:
        """Close the connection without a word."""
        self.socket.close()


class Script(threading.Thread):
    """A client in a thread of its own; what it raises is kept."""

    def __init__(self, work: Callable[[], None]) -> None:
        super().__init__(daemon=True)
        self._work = work
        self.error: BaseException | None = None
        self.start()

    def run(self) -> None:
        """Connect and run the script."""
        try:
            self._work()
        except BaseException as error:
            self.error = error
