"""The link over eclipse-zenoh; the only file that imports it.

The master's session routes, so that a slave and a recorder that only dial the master also hear each
other. One publisher per channel, express, at real-time priority, dropped rather than blocked when the
network is congested: a late frame is worth nothing, and a blocked loop would be a fault (docs/decisions).
With certificates the link is TLS, and the master's session holds every other to the routes of its role.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from threading import get_ident
from typing import TYPE_CHECKING

import zenoh

from common.errors import InputError, InterlockError, LostError
from common.link.access import access_control, guests
from common.link.address import checked, dialled, secured
from common.link.transport import SAMPLES, Packet, Route, heard, said
from common.protocol.codec import MOST_FRAME
from common.roles import MASTER, SLAVE

# decides nothing about a rig, since the loops judge silence by messages: it only frees the link of a dead peer
LEASE_MS = 1000
ATTEMPT_MS = 500  # opening a session cannot be interrupted, so it is tried again and again for this long
# A connection on which nobody completes zenoh's handshake is dropped after this time. Our own processes give a dial up
# after half of it. With zenoh's 10 s, strangers who say nothing keep everybody else out for as long.
ACCEPT_MS = 2 * ATTEMPT_MS
# So many such connections are open at a time, and others wait until they are dropped. It is half of the 1024 open files
# that a process usually may have.
ACCEPT_PENDING = 512
# zenoh puts the fragments of a message together up to this size and drops a larger one while it comes in. No frame of
# ours is larger than MOST_FRAME (a piece of the stream to the recorder has some 2 kB, 50 kB with 100 storeys), and the
# codec rejects any that is; the rest is for zenoh's header with the key. Its default is 1 GiB.
MOST_MESSAGE = MOST_FRAME + (1 << 12)
PREFIX = "rths"
REFUSED = "zenoh_link_tls=warn"  # log of zenoh's that names every dial it refuses
YIELD = getattr(os, "sched_yield", lambda: None)  # not every system has it

if TYPE_CHECKING:
    from common.link.security import Identity


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
        "transport/unicast/accept_timeout": ACCEPT_MS,
        "transport/unicast/accept_pending": ACCEPT_PENDING,
        "transport/link/rx/max_message_size": MOST_MESSAGE,
        "transport/link/tx/lease": LEASE_MS,
        "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 0,
        "transport/shared_memory/enabled": False,
    }
    insert(config, settings)
    return config


def insert(config: zenoh.Config, settings: Mapping[str, object]) -> None:
    """Set what is at these paths of a configuration."""
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))


def secure(config: zenoh.Config, identity: Identity, test: str, slaves: Sequence[str]) -> None:
    """Show a certificate and ask for one; the master's session holds every other to its role's routes."""
    insert(config, identity.settings())
    if identity.role == MASTER:
        insert(config, {"access_control": access_control(slaves, partial(key, test))})


def reach(
    config: zenoh.Config,
    connect: str,
    seconds: float,
    stopping: Callable[[], str],
    refusal: Callable[[str], str],
) -> zenoh.Session:
    """A session that has reached the master, tried for `seconds`; `refusal` says why an endpoint takes nobody in.

    Raises:
        InputError: the certificate is refused, which waiting does not cure.
        LostError: nothing listens there.
        InterlockError: somebody wants to stop.
    """
    deadline = time.monotonic() + seconds
    while True:
        if reason := stopping():
            raise InterlockError(reason)
        try:
            return zenoh.open(config)
        except zenoh.ZError:
            if reason := refusal(connect):
                raise InputError(reason) from None
            if time.monotonic() > deadline:
                raise LostError(unreached(connect, seconds)) from None


def unrefused(_: str) -> str:
    """No certificate is refused on an open link."""
    return ""


def unreached(connect: str, seconds: float) -> str:
    """Why no master was reached, as far as that is known."""
    from common.link import tls

    return (
        tls.mismatch(connect)
        or f"No master was reached at {connect} within {seconds:g} s: check the address and that it runs."
    )


def key(test: str, route: Route) -> str:
    """The key expression of a route."""
    return "/".join((PREFIX, test, *filter(None, route)))


class ZenohLink:
    """One role's access to the link of a test; `listen` and `connect` are zenoh endpoints (tcp/host:port).

    `slaves` are the roles of all slaves of the test. With an identity the link is TLS and the endpoints are those of
    TLS too.
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
        identity: Identity | None = None,
    ) -> None:
        if identity is not None:
            listen, connect = secured(listen), dialled(connect)
            os.environ.setdefault("NO_COLOR", "1")  # zenoh would colour its log even in a file
        zenoh.init_log_from_env_or(REFUSED if identity is not None and listen else "off")
        config = configuration(role, checked(listen), checked(connect))
        if identity is not None:
            secure(config, identity, test, slaves)
        if listen:
            self._session = self._listening(config, listen)
        else:
            refusal = identity.refusal if identity is not None else unrefused
            self._session = reach(config, connect, patience, stopping, refusal)
        self._expected = guests(slaves) if listen and identity is not None else None
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

    def watch(self, noticed: Callable[[str], None]) -> None:
        """Tell of everybody whose certificate is the authority's but of no role of the test, from a thread of zenoh's.

        Those who have joined already are told of too; where this end does not listen with an identity, nobody is.
        """
        if self._expected is None:
            return
        expected = self._expected

        def joined(event: zenoh.LinkEvent) -> None:
            name = event.link.auth_identifier
            if event.kind == zenoh.SampleKind.PUT and name not in expected:
                noticed(
                    f"'{name}' has joined with a certificate of no role in this test: nothing of it passes."
                )

        self._session.info.declare_link_events_listener(joined, history=True)

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
        with contextlib.suppress(zenoh.ZError):  # closing fails where the peer has gone
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
    """An endpoint on loopback at a port that is free at present."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
