"""TCP ports at which clients of OpenSees or OpenFresco are served, one client at a time on each port.

Calls block at most for the time they are given, and there are no threads: the caller decides when there is time for the
clients.
"""

from __future__ import annotations

import errno
import ipaddress
import os
import re
import select
import socket
import time
from collections.abc import Callable, Sequence
from typing import Any

from common.errors import InputError, LostError, RemoteProtocolError
from common.host.realtime import give_way
from common.opensees.element import ElementServer, Measurement, Phase, RevisedError

ADDRESS = re.compile(r"(?:(.+):)?(\d+)")
LOOPBACK = "127.0.0.1"
BYTES = 1 << 16  # read from a socket at once: 32 messages of the default size
QUICKACK = getattr(socket, "TCP_QUICKACK", None)  # exists on Linux only
LOOKS = 64  # reads from the present client, to see whether it has ended, before a second one is refused: 4 MB
OTHERS = 4  # messages in a row of a single client, after which others are looked for as well
TOLD = 10  # refused clients that are reported by an event; more would fill the recording

Say = Callable[[str], None]


def is_open(host: str) -> bool:
    """Whether other machines can connect to an address."""
    return not ipaddress.IPv4Address(host).is_loopback


def address_of(text: str) -> tuple[str, int]:
    """Host, as a dotted address, and port of `HOST:PORT` or `PORT`; the loopback address if there is no host.

    Raises:
        InputError: the text has another form, or is not an IPv4 address; OpenSees connects to IPv4 addresses only.
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


def check_free(text: str) -> None:
    """Raise InputError where an address cannot be served; nobody can connect to it meanwhile."""
    place = address_of(text)
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(place)
        except OSError as error:
            raise unusable(*place, error) from None


def unusable(host: str, port: int, error: OSError) -> InputError:
    """The message for an address that cannot be served."""
    elsewhere = error.errno == errno.EADDRNOTAVAIL
    remedy = "give an address of this machine" if elsewhere else "choose another port"
    reason = os.strerror(error.errno) if error.errno else str(error)  # `strerror` may repeat the address
    return InputError(f"Cannot serve OpenSees at {host}:{port}: {reason}; {remedy}.")


class ClientError(LostError):
    """A client disconnected, sent nothing, or sent messages that are not valid (exit 4)."""


class ElementPort:
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
            raise unusable(host, port, error) from None
        self.listener.setblocking(False)

    def accept(self) -> None:
        """Accept a client, or refuse it if there is another one."""
        try:
            client, (host, port) = self.listener.accept()
        except OSError:  # the client has disconnected again
            return
        peer = f"{host}:{port}"
        for _ in range(LOOKS):  # the present client may have ended meanwhile
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
        """Process the bytes that the client has sent, and answer; returns whether there were any.

        Raises:
            ClientError: the client disconnected or sent an invalid message after it has moved the laboratories.
            RevisedError: it changes a displacement that was imposed in the same step.
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
        if (
            QUICKACK is not None
        ):  # otherwise the client's next small message waits 40 ms for an acknowledgement
            client.setsockopt(socket.IPPROTO_TCP, QUICKACK, 1)
        self._fed(self.server.take, data)
        return True

    def measured(self, found: Measurement) -> None:
        """Send the client the measurements at its displacements if it waits for them; raises as `read`."""
        self._fed(self.server.measured, found)

    def _fed(self, feed: Callable[[Any], None], what: Any) -> None:
        """Pass `what` to the server and send its answers."""
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
        """Send the answers; raises ClientError if the client does not receive them."""
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
        """Close the connection, so that another may connect; raises ClientError if this client has moved anything."""
        server = self.server
        silent, moved = server.ending or server.untouched, server.steps > 0
        self.leave()
        if silent:  # the client has ended, or only checked whether the port is open
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
    """All ports of a test, one for each element.

    For `eager` ns a single client's next message is looked for before the process sleeps until it comes.
    """

    def __init__(self, ports: Sequence[ElementPort], eager: int = 0) -> None:
        self.ports = ports
        self._eager = eager
        self._one = ports[0] if len(ports) == 1 else None
        self._looks = 0  # in a row, at which a single client had sent something
        self._poll = select.poll()
        for port in ports:
            self._poll.register(port.listener, select.POLLIN)
        self._polled: dict[int, ElementPort] = {}  # clients by descriptor

    @property
    def servers(self) -> list[ElementServer]:
        """The server of each port."""
        return [port.server for port in self.ports]

    def serve(self, seconds: float) -> bool:
        """Process messages and connections, waiting for them at most `seconds`; returns whether there were any.

        Raises:
            ClientError, RevisedError: as `ElementPort.read`.
        """
        looked = self._one is not None and self._looked(self._one, self._eager if seconds > 0.0 else 0)
        self._looks = self._looks + 1 if looked else 0
        if looked and self._looks % OTHERS:
            return True
        ready = self._ready(0.0 if looked else seconds)
        for port in self.ports:
            if port.client is not None and port.client.fileno() in ready:
                port.read()  # a client that has ended makes room for the next one
            if port.listener.fileno() in ready:
                port.accept()
        return looked or bool(ready)

    @staticmethod
    def _looked(port: ElementPort, eager: int) -> bool:
        """Whether a client's bytes were processed, looked for once, and then for `eager` ns more where they may come.

        It succeeds in nearly every call, and saves the call of `poll`.
        """
        if port.read():
            return True
        if not eager or port.client is None or port.server.full:
            return False
        end = time.monotonic_ns() + eager
        while time.monotonic_ns() < end:
            give_way()  # the client may need this processor
            if port.read():
                return True
        return False

    def _ready(self, seconds: float) -> list[int]:
        """The descriptors that have something to be read; of a client that waits for us none is expected."""
        wanted = {
            port.client.fileno(): port
            for port in self.ports
            if port.client is not None and not port.server.full
        }
        if wanted != self._polled:
            for descriptor in self._polled.keys() - wanted.keys():
                self._poll.unregister(descriptor)
            for descriptor in wanted.keys() - self._polled.keys():
                self._poll.register(descriptor, select.POLLIN)
            self._polled = wanted
        return [descriptor for descriptor, _ in self._poll.poll(seconds * 1e3)]

    def close(self) -> None:
        """Close all connections and ports."""
        for port in self.ports:
            port.close()
