"""Ports at which clients of OpenSees or OpenFresco are served, over TCP: one client a port, no second one.

Nothing here blocks for longer than it is told to, and no thread is begun: whoever drives the laboratories says when
there is time for the clients.
"""

from __future__ import annotations

import ipaddress
import re
import select
import socket
from collections.abc import Callable, Sequence
from typing import Any

from common.errors import InputError, LostError, RemoteProtocolError
from common.opensees.element import ElementServer, Measurement, Phase, RevisedError

ADDRESS = re.compile(r"(?:(.+):)?(\d+)")
LOOPBACK = "127.0.0.1"
BYTES = 1 << 16  # taken from a socket at once: 32 messages of the default size
QUICKACK = getattr(socket, "TCP_QUICKACK", None)  # on Linux alone
LOOKS = 64  # at what the client that is there has sent, before another one is turned away
TOLD = 10  # clients turned away that are reported, each with an event of its own

Say = Callable[[str], None]


def is_open(host: str) -> bool:
    """Whether others than this machine reach an address."""
    return not ipaddress.IPv4Address(host).is_loopback


def address_of(text: str) -> tuple[str, int]:
    """Host, as a dotted address, and port of `HOST:PORT` or `PORT`; loopback where no host is given.

    Raises:
        InputError: it is none, or no address of IPv4, which is all that OpenSees connects to.
    """
    found = ADDRESS.fullmatch(text)
    host = "" if found is None else (found[1] or LOOPBACK).replace("localhost", LOOPBACK)
    try:
        ipaddress.IPv4Address(host)
    except ValueError:
        raise InputError(
            f"'{text}' is no address that OpenSees connects to: write HOST:PORT with a dotted IPv4 address, such as "
            f"{LOOPBACK}:8090."
        ) from None
    port = int(found[2]) if found else 0
    if not 0 < port < 65536:
        raise InputError(f"The port {port} of '{text}' must be from 1 to 65535.")
    return host, port


class ClientError(LostError):
    """A client has gone, stalled or sent what makes no sense (exit 4)."""


class Port:
    """One port and the client that is served there; `stiffness` (N/m) is that of its degrees of freedom."""

    def __init__(self, text: str, stiffness: Sequence[float], say: Say) -> None:
        host, port = address_of(text)
        self.name = f"{host}:{port}"
        self.dofs = len(stiffness)
        self._stiffness = stiffness
        self._say = say
        self._turned_away = 0
        self.server = ElementServer(stiffness)
        self.client: socket.socket | None = None
        self.peer = ""
        try:
            self.listener = socket.create_server((host, port), family=socket.AF_INET, backlog=64)
        except OSError as error:
            raise InputError(
                f"Cannot serve OpenSees at {self.name}: {error.strerror}; choose another port."
            ) from None
        self.listener.setblocking(False)

    def accept(self) -> None:
        """Take the client that calls, or turn it away where one is there already."""
        try:
            client, (host, port) = self.listener.accept()
        except OSError:  # it has gone again
            return
        peer = f"{host}:{port}"
        for _ in range(LOOKS):  # the one that is there may have gone since
            if self.client is None or self.server.steps or not self.read():
                break
        if self.client is not None or self.server.ending:
            client.close()
            self._turned_away += 1
            if self._turned_away <= TOLD:
                self._say(
                    f"A second client, from {peer}, was turned away from {self.name}: one at a time is served, and "
                    f"{self.peer} came first."
                )
            return
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.client, self.peer, self.server = client, peer, ElementServer(self._stiffness)

    def read(self) -> bool:
        """Take in what the client has sent, and answer; whether there was anything.

        Raises:
            ClientError: it has gone, or sends what makes no sense, after it has moved the laboratories.
            RevisedError: it revises displacements.
        """
        client = self.client
        if client is None or self.server.full:
            return False
        try:
            data = client.recv(BYTES)
        except BlockingIOError:
            return False
        except OSError as error:
            self._gone(f"is lost: {error.strerror or 'the connection broke'}")
            return True
        if not data:
            self._gone("is lost: it closed the connection without saying that its analysis is over")
            return True
        if QUICKACK is not None:  # else the client's next small message waits 40 ms for an acknowledgement
            client.setsockopt(socket.IPPROTO_TCP, QUICKACK, 1)
        self._fed(self.server.take, data)
        return True

    def measured(self, found: Measurement) -> None:
        """Hand the client what was measured at its displacements; raises as `read`."""
        self._fed(self.server.measured, found)

    def _fed(self, feed: Callable[[Any], None], what: Any) -> None:
        """Let the server take something in, and send what it answers."""
        try:
            feed(what)
        except RevisedError:
            self.flush()
            raise
        except RemoteProtocolError as error:
            self._gone(f"was turned away: {error}")
            return
        self.flush()
        if self.server.phase is Phase.ENDED:
            self.leave()
            if not self.server.steps:
                self.server = ElementServer(self._stiffness)

    def flush(self) -> None:
        """Send what is to be answered; raises ClientError where the client does not take it."""
        if self.client is None or not (data := self.server.outgoing()):
            return
        try:
            sent = self.client.send(data)
        except OSError as error:
            self._gone(f"is lost: {error.strerror or 'the connection broke'}")
            return
        if sent < len(data):
            self._gone("was turned away: it does not take its answers")

    def _gone(self, how: str) -> None:
        """The client is served no more; before it has moved anything the next one may come."""
        server = self.server
        silent, moved = server.ending or server.untouched, server.steps > 0
        self.leave()
        if silent:  # it has said that it ends, or has only looked whether somebody is there
            return
        text = f"The client at {self.peer} {how.rstrip('.')}."
        if moved:
            raise ClientError(text)
        self._say(f"{text} Nothing had moved, and the next one is served.")
        self.server = ElementServer(self._stiffness)

    def leave(self) -> None:
        """Close the connection."""
        if self.client is not None:
            self.client.close()
            self.client = None

    def close(self) -> None:
        """Close the connection and the port."""
        self.leave()
        self.listener.close()


class Ports:
    """All ports of a test, one for each element."""

    def __init__(self, ports: Sequence[Port]) -> None:
        self.ports = ports
        self._one = ports[0] if len(ports) == 1 else None

    @property
    def servers(self) -> list[ElementServer]:
        """What is said with each client."""
        return [port.server for port in self.ports]

    def serve(self, seconds: float) -> bool:
        """Serve whoever has something to say, waiting at most `seconds` for it; whether there was anything.

        Raises:
            ClientError, RevisedError: as `Port.read`.
        """
        if self._one is not None and self._one.read():  # as in nearly every call, without asking who is ready
            return True
        ready = self._ready(seconds)
        if not ready:
            return False
        for port in self.ports:
            if port.client is not None and port.client.fileno() in ready:
                port.read()  # one that has gone makes room for the one that calls
            if port.listener.fileno() in ready:
                port.accept()
        return True

    def _ready(self, seconds: float) -> set[int]:
        """The descriptors that have something to be read."""
        poll = select.poll()
        for port in self.ports:
            poll.register(port.listener, select.POLLIN)
            if port.client is not None and not port.server.full:
                poll.register(port.client, select.POLLIN)
        return {descriptor for descriptor, _ in poll.poll(max(seconds, 0.0) * 1e3)}

    def close(self) -> None:
        """Close all of them."""
        for port in self.ports:
            port.close()
