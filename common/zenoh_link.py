"""The link over eclipse-zenoh; the only file that imports it.

The master's session routes, so that a slave and a recorder that only dial the master also hear each
other. One publisher per channel, express, at real-time priority, dropped rather than blocked when the
network is congested: a late frame is worth nothing, and a blocked loop would be a fault (docs/decisions).
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import re
import socket
import time
from collections.abc import Callable, Sequence
from threading import get_ident

import zenoh

from common.errors import InputError, InterlockError, LostError
from common.roles import SLAVE
from common.transport import SAMPLES, Packet, Route, heard, said

LEASE_MS = 1000
ATTEMPT_MS = 500  # opening a session cannot be interrupted, so it is tried again and again for this long
ENDPOINT = re.compile(r"(tcp|tls|udp|quic)/.+:\d+")
PREFIX = "rths"
YIELD = getattr(os, "sched_yield", lambda: None)  # not every system has it


def configuration(role: str, listen: str, connect: str) -> zenoh.Config:
    """Configuration of one role: no discovery, one static link, short lease, constant retry."""
    config = zenoh.Config()
    settings: dict[str, object] = {
        "mode": "router" if role == "master" else "client",
        "listen/endpoints": [listen] if listen else [],
        "connect/endpoints": [connect] if connect else [],
        "connect/timeout_ms": ATTEMPT_MS,
        "connect/exit_on_failure": True,
        "connect/retry": {"period_init_ms": 20, "period_max_ms": 20, "period_increase_factor": 1},
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/link/tx/lease": LEASE_MS,
        "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 0,
        "transport/shared_memory/enabled": False,
    }
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))
    return config


def checked(endpoint: str) -> str:
    """The endpoint itself; raises InputError where it is none."""
    if endpoint and not ENDPOINT.fullmatch(endpoint):
        raise InputError(f"'{endpoint}' is no endpoint: write it as tcp/HOST:PORT.")
    return endpoint


def reach(config: zenoh.Config, connect: str, seconds: float, stopping: Callable[[], str]) -> zenoh.Session:
    """A session that has reached the master, tried for `seconds`.

    Raises:
        LostError: nobody listens there.
        InterlockError: somebody wants to stop.
    """
    deadline = time.monotonic() + seconds
    while True:
        if reason := stopping():
            raise InterlockError(reason)
        try:
            return zenoh.open(config)
        except zenoh.ZError:
            if time.monotonic() > deadline:
                raise LostError(
                    f"No master was reached at {connect} within {seconds:g} s: check the address and that it runs."
                ) from None


def key(test: str, route: Route) -> str:
    """The key expression of a route."""
    return "/".join((PREFIX, test, *filter(None, route)))


class ZenohLink:
    """One role's access to the link of a test; `listen` and `connect` are zenoh endpoints (tcp/host:port).

    `slaves` are the roles of all slaves of the test.
    """

    def __init__(
        self,
        role: str,
        test: str,
        *,
        slaves: Sequence[str] = (SLAVE,),
        listen: str = "",
        connect: str = "",
        patience: float = 0.0,
        stopping: Callable[[], str] = str,
    ) -> None:
        zenoh.init_log_from_env_or("off")
        config = configuration(role, checked(listen), checked(connect))
        if listen:
            self._session = self._listening(config, listen)
        else:
            self._session = reach(config, connect, patience, stopping)
        self._publishers = {
            (route.channel, route.to): self._session.declare_publisher(
                key(test, route),
                express=route.channel != SAMPLES,
                priority=zenoh.Priority.DATA if route.channel == SAMPLES else zenoh.Priority.REAL_TIME,
                congestion_control=zenoh.CongestionControl.DROP,
                reliability=zenoh.Reliability.RELIABLE,
            )
            for route in said(role, slaves)
        }
        self._heard = [(route, key(test, route)) for route in heard(role, slaves)]
        self._subscribers: list[zenoh.Subscriber[None]] = []

    @staticmethod
    def _listening(config: zenoh.Config, listen: str) -> zenoh.Session:
        try:
            return zenoh.open(config)
        except zenoh.ZError:
            raise InputError(
                f"Cannot listen on {listen}: the port is in use or the address is not this machine's; "
                "choose another with --listen."
            ) from None

    def listen(self, heard: Callable[[Packet], None]) -> None:
        """From now on call `heard` with every frame, from the thread of zenoh's that receives it."""
        self._subscribers += [
            self._session.declare_subscriber(
                name, zenoh.handlers.Callback(calling(heard, route), indirect=False)
            )
            for route, name in self._heard
        ]

    def send(self, channel: str, frame: bytes, to: str = "") -> None:
        """Hand a frame to the link; dropped where the network is congested."""
        self._publishers[channel, to].put(frame)
        YIELD()  # to the link's own thread on this processor, which writes the frame

    def close(self) -> None:
        """Leave the link; without it, zenoh's threads would keep the process alive."""
        with contextlib.suppress(zenoh.ZError):  # a peer that is gone cannot be said goodbye to
            self._session.close()  # type: ignore[no-untyped-call]


def calling(heard: Callable[[Packet], None], route: Route) -> Callable[[zenoh.Sample], None]:
    """A callback of zenoh's that hands a route's frames on, stamped as they arrive."""
    now = time.monotonic_ns
    attached: set[int] = set()

    def call(sample: zenoh.Sample) -> None:
        received_ns = now()
        heard(Packet(route.role, route.channel, sample.payload.to_bytes(), received_ns))
        if get_ident() not in attached:
            attached.add(get_ident())
            stay_attached()

    return call


def stay_attached() -> None:
    """Let the interpreter keep what it knows of the calling thread, one of zenoh's, until the process ends.

    Called by a thread that Python did not start, it would make and drop a thread state with every frame, which costs
    more than the rest of the call.
    """
    ctypes.pythonapi.PyGILState_Ensure()


def listenable() -> str:
    """An endpoint on loopback at a port that nobody uses now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
