"""Both ends of the compared transports: an exchange is one frame there and one frame back.

`rths` is the exchange of a test: frames of the codec over the link, answered by the slave's loop with its step and
limits, whose laboratory stands still. `rths_tls` is the same over a link with certificates and access control;
`rths_lab` has the emulated laboratory. The other transports carry as many bytes and do nothing else.
"""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import zenoh

from common.host.clock import MonotonicClock
from common.lab.laboratory import Setting
from common.link import security
from common.link.endpoint import FrameEndpoint
from common.link.security import Identity
from common.link.zenoh_link import ZenohLink
from common.plan.laboratory_tables import LaboratoryTable, RigTable
from common.plan.plan import PROTOCOL_VERSION, Plan
from common.plan.tables import Link, RecordingTable, SafetyTable, Security
from common.protocol.messages import (
    Arm,
    Armed,
    Command,
    Feedback,
    Message,
    Register,
    Registered,
    Scheduled,
    Start,
)
from common.reality import reality
from common.rig import TableCommand
from slave.assembly import build_loop

PAYLOAD = b"x" * 110  # bytes: between the frames of a command (100) and of a feedback (118)
NAMES = ("rths", "rths_tls", "rths_lab", "zenoh", "tcp", "udp")
SESSION = INSTANCE = 1
PATIENCE_S = 20.0  # for the other end to start and to answer; it starts in about 3 s on an idle machine
# The transports take turns, so that a tick is not exchanged at its nominal time. The start is agreed so far ahead that
# no tick is late, and messages of any age are accepted. Both times are longer than any run, which takes minutes.
LEAD_S = 1_800.0
NEVER_S = 3_600.0


class Asking(Protocol):
    """The end that sends first."""

    def exchange(self) -> int:
        """Send a frame and wait for the answer; returns the time of its receipt, ns."""

    def close(self) -> None:
        """Close the connection."""


class StillTable:
    """A rig that takes no time, so that only the exchange is measured."""

    def __init__(self, interval: float, seed: int) -> None:
        pass

    def arm(self) -> None:
        """Do nothing: there is no actuator."""

    def read(self) -> tuple[float, float, float, float]:
        """Readings at rest."""
        return (0.0, 0.0, 0.0, 0.0)

    def write(self, command: TableCommand) -> None:
        """Do nothing: there is no actuator."""

    def disarm(self) -> None:
        """Do nothing: there is no actuator."""


LABORATORIES = {
    "rths": LaboratoryTable(RigTable(class_=f"{__name__}:{StillTable.__name__}")),
    "rths_tls": LaboratoryTable(RigTable(class_=f"{__name__}:{StillTable.__name__}")),
    "rths_lab": LaboratoryTable(),
}
SECURE = ("rths_tls",)


def bench_plan(kind: str, keys: Path) -> Plan:
    """The default test without a recorder, with the laboratory of a transport; `keys` is a folder of certificates."""
    return replace(
        Plan(),
        test=replace(Plan().test, name=kind),
        link=Link(connect_timeout=NEVER_S, security=Security(str(keys) if kind in SECURE else "")),
        safety=SafetyTable(message_age=NEVER_S),
        slave=LABORATORIES[kind],
        recording=RecordingTable(required=False),
    )


def identity(plan: Plan, role: str) -> Identity | None:
    """A role's certificate, None for a link without encryption."""
    return security.identity(plan, role) if plan.link.security.folder else None


class RthsAsking:
    """The master's end: it encodes and sends a command; it receives, checks and decodes the feedback."""

    def __init__(self, kind: str, keys: Path, host: str, port: int) -> None:
        plan = bench_plan(kind, keys)
        who = identity(plan, "master")
        self._link = ZenohLink("master", plan.test.name, listen=f"tcp/{host}:{port}", identity=who)
        self._endpoint = FrameEndpoint(self._link, plan.digest())
        self._endpoint.enter(SESSION)
        self._agree(Register(SESSION, PROTOCOL_VERSION, plan.digest()), Registered)
        self._agree(Arm(SESSION, INSTANCE), Armed)
        start_ns = time.monotonic_ns() + round(LEAD_S * 1e9)
        self._agree(Start(SESSION, start_ns, start_ns), Scheduled)
        self._seq = 0

    def _agree(self, request: Message, answer: type) -> None:
        for _ in range(int(PATIENCE_S / 0.1)):
            self._endpoint.send(request)
            while (received := self._endpoint.receive(0.1)) is not None:
                if isinstance(received.message, answer):
                    return
        raise TimeoutError(f"no {answer.__name__} from the slave")

    def exchange(self) -> int:
        """Send a command and wait for the feedback of the tick that uses it; returns when it was decoded, ns."""
        seq = self._seq
        self._seq += 1
        now = time.monotonic_ns()
        self._endpoint.send(Command(SESSION, seq, now, 0, seq - 1, 1e-3, 1.0, 1e-2, 0.1, 1.0))
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            received = self._endpoint.receive(1.0)
            if received and isinstance(received.message, Feedback) and received.message.command_seq == seq:
                return received.decoded_ns
        raise TimeoutError(f"no feedback from the slave that uses command {seq}")

    def close(self) -> None:
        """Close the link."""
        self._link.close()


def answer_rths(kind: str, keys: Path, host: str, port: int, ended: Callable[[], bool]) -> None:
    """The slave's end: its loop and laboratory do a tick for every command, until `ended` returns true."""
    plan = bench_plan(kind, keys)
    link = ZenohLink(
        "slave",
        plan.test.name,
        connect=f"tcp/{host}:{port}",
        patience=PATIENCE_S,
        identity=identity(plan, "slave"),
    )
    endpoint = FrameEndpoint(link, plan.digest())
    loop = build_loop(Setting(plan, endpoint, MonotonicClock()), reality.as_planned(plan), instance=INSTANCE)
    while not ended():
        received = endpoint.receive(0.2)
        if received is not None:
            loop.take(received)
            if isinstance(received.message, Command):
                loop.tick(received.message.seq)
    link.close()


def bare_session(listen: str = "", connect: str = "") -> zenoh.Session:
    """A zenoh session with one fixed link and without discovery."""
    config = zenoh.Config()
    config.insert_json5("listen/endpoints", json.dumps([listen] if listen else []))
    config.insert_json5("connect/endpoints", json.dumps([connect] if connect else []))
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


class ZenohAsking:
    """Bare zenoh: put a payload, then wait for the echo."""

    def __init__(self, host: str, port: int) -> None:
        self._session = bare_session(listen=f"tcp/{host}:{port}")
        self._heard = self._session.declare_subscriber("bench/pong", zenoh.handlers.RingChannel(1))
        self._publisher = self._session.declare_publisher("bench/ping", express=True)
        deadline = MonotonicClock().now() + int(PATIENCE_S * 1e9)
        while not self._publisher.matching_status.matching:  # type: ignore[attr-defined]
            if MonotonicClock().now() > deadline:
                raise TimeoutError(f"no subscriber over bare zenoh within {PATIENCE_S:g} s")
            MonotonicClock().sleep_until(MonotonicClock().now() + 10_000_000)

    def exchange(self) -> int:
        """Send a payload and wait for its echo; returns the time of its receipt, ns."""
        self._publisher.put(PAYLOAD)
        self._heard.recv().payload.to_bytes()
        return time.monotonic_ns()

    def close(self) -> None:
        """Close the session."""
        self._session.close()  # type: ignore[no-untyped-call]


def answer_zenoh(host: str, port: int) -> Callable[[], None]:
    """Echo payloads in the callback of zenoh; returns the function that ends it."""
    deadline = MonotonicClock().now() + int(PATIENCE_S * 1e9)
    while True:
        try:
            session = bare_session(connect=f"tcp/{host}:{port}")
            break
        except zenoh.ZError:
            if MonotonicClock().now() > deadline:
                raise
    publisher = session.declare_publisher("bench/pong", express=True)
    session.declare_subscriber("bench/ping", lambda sample: publisher.put(sample.payload))
    return session.close


class TcpAsking:
    """A bare TCP socket without Nagle's algorithm."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.create_connection((host, port), timeout=PATIENCE_S)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def exchange(self) -> int:
        """Send a payload and wait for its echo; returns the time of its receipt, ns."""
        self._socket.sendall(PAYLOAD)
        left = len(PAYLOAD)
        while left:
            left -= len(self._socket.recv(left))
        return time.monotonic_ns()

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def answer_tcp(host: str, port: int) -> None:
    """Listen, and echo payloads in a thread of its own."""
    server = socket.create_server((host, port))

    def serve() -> None:
        peer, _ = server.accept()
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        while data := peer.recv(4096):
            peer.sendall(data)

    threading.Thread(target=serve, daemon=True).start()


class UdpAsking:
    """A bare UDP socket."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.settimeout(PATIENCE_S)
        self._socket.connect((host, port))

    def exchange(self) -> int:
        """Send a payload and wait for its echo; returns the time of its receipt, ns."""
        self._socket.send(PAYLOAD)
        self._socket.recv(4096)
        return time.monotonic_ns()

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def answer_udp(host: str, port: int) -> None:
    """Echo payloads in a thread of its own."""
    server = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    server.bind((host, port))

    def serve() -> None:
        while True:
            data, sender = server.recvfrom(4096)
            server.sendto(data, sender)

    threading.Thread(target=serve, daemon=True).start()
