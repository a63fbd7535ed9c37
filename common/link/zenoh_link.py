"""The link over eclipse-zenoh; the only file that imports it.

The master's session routes, so that a slave and a recorder that connect to the master alone also hear each other.
Each channel has one publisher, express and at real-time priority. When the network is congested frames are dropped
rather than the sender blocked: a late frame is useless, and a blocked loop would be a fault (docs/decisions).
With certificates the link is TLS, and the master's session restricts every other one to the routes of its role.
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
from common.host.realtime import give_way
from common.link.access import access_control, guests
from common.link.address import checked, dialled, secured
from common.link.transport import SAMPLES, Packet, Route, heard, said
from common.protocol.codec import MOST_FRAME
from common.roles import MASTER, SLAVE

# After this silence zenoh drops a dead peer. The loops judge silence by their messages, so no rig depends on it; a
# second exceeds the pauses of a machine (0.5 s were seen), which should not cost the connection.
LEASE_MS = 1000
# Opening a session cannot be interrupted, so it is attempted for this time again and again; a user who stops the
# process waits for half a second at most.
ATTEMPT_MS = 500
RETRY_MS = (
    20  # between the connection attempts within it: short beside the second that a process takes to start
)
# A connection on which zenoh's handshake is not completed is dropped after this time. Our own processes give up an
# attempt after half of it. With zenoh's default of 10 s, silent strangers would keep everybody else out for as long.
ACCEPT_MS = 2 * ATTEMPT_MS
# Largest number of such connections at a time; others wait until these are dropped. It is half of the 1024 open files
# that a process may usually have.
ACCEPT_PENDING = 512
# zenoh assembles the fragments of a message up to this size and drops a larger one while it comes in. No frame of ours
# is larger than MOST_FRAME (a piece of the stream to the recorder has some 2 kB, 50 kB with 100 storeys), and the codec
# rejects any that is; 4 kB more are for zenoh's header with the key. zenoh's default is 1 GiB.
MOST_MESSAGE = MOST_FRAME + (1 << 12)
# zenoh drops a connection without a handshake in its acceptor's threads, where each close waits some 40 ms for the
# other end. With zenoh's single thread, a hundred connections dropped together kept the feedback out for over 50 ms;
# with two threads no tick was late (row F51 of docs/reference/faults.md).
RUNTIME = "(acc: (worker_threads: 2))"
PREFIX = "rths"
REFUSED = "zenoh_link_tls=warn"  # filter of zenoh's log that shows every refused TLS connection

if TYPE_CHECKING:
    from common.link.security import Identity

os.environ.setdefault("ZENOH_RUNTIME", RUNTIME)  # which zenoh reads as the first session of a process opens


def configuration(role: str, listen: str, connect: str) -> zenoh.Config:
    """Configuration of one role: no discovery, one static link, short lease, constant retry."""
    config = zenoh.Config()
    settings: dict[str, object] = {
        "mode": "router" if role == "master" else "client",
        "listen/endpoints": [listen] if listen else [],
        "connect/endpoints": [connect] if connect else [],
        "connect/timeout_ms": ATTEMPT_MS,
        "connect/exit_on_failure": True,
        "connect/retry": {
            "period_init_ms": RETRY_MS,
            "period_max_ms": RETRY_MS,
            "period_increase_factor": 1,
        },
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
    """Set the values at these paths of a configuration."""
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))


def secure(config: zenoh.Config, identity: Identity, test: str, slaves: Sequence[str]) -> None:
    """Configure TLS with certificates of both ends, and at the master the access control of every other role."""
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
    """A session connected to the master, attempted for `seconds`.

    `stopping` returns the reason to give up, and `refusal` why an endpoint refuses the certificate; both return an
    empty text where there is none.

    Raises:
        InputError: the certificate is refused, which does not change by waiting.
        LostError: no master was reached in time.
        InterlockError: the user asked to stop.
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
    """An empty text: without certificates none can be refused."""
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
        """Call `noticed` for every peer whose certificate is valid but of no role of the test, in a thread of zenoh's.

        It is called for peers that have joined already too. Where this end does not listen with certificates, nothing
        is reported.
        """
        if self._expected is None:
            return
        expected = self._expected

        def joined(event: zenoh.LinkEvent) -> None:
            name = event.link.auth_identifier
            if event.kind == zenoh.SampleKind.PUT and name not in expected:
                noticed(
                    f"'{name}' has joined with a certificate of no role in this test: its messages are blocked."
                )

        self._session.info.declare_link_events_listener(joined, history=True)

    @property
    def connected(self) -> bool:
        """Whether the master is connected to this end, which dialled it.

        A master that is silent for `LEASE_MS` is not connected any more. zenoh dials it again until it answers.
        """
        return bool(self._session.info.routers_zid())

    def listen(self, heard: Callable[[Packet], None]) -> None:
        """Call `heard` with every frame from now on, in the thread of zenoh's that receives it."""
        self._subscribers += [
            self._session.declare_subscriber(
                name, zenoh.handlers.Callback(calling(heard, route), indirect=False)
            )
            for route, name in self._heard
        ]

    def send(self, channel: str, frame: bytes, to: str = "") -> None:
        """Hand a frame to the link; dropped where the network is congested."""
        self._publishers[channel, to].put(frame)
        give_way()  # lets the link's thread run on this processor, which writes the frame

    def close(self) -> None:
        """Close the session; otherwise zenoh's threads would keep the process alive."""
        with contextlib.suppress(zenoh.ZError):  # closing fails where the peer has gone
            self._session.close()  # type: ignore[no-untyped-call]


def calling(heard: Callable[[Packet], None], route: Route) -> Callable[[zenoh.Sample], None]:
    """A callback for zenoh that stamps a route's frames on arrival and hands them to `heard`."""
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
    """Let the interpreter keep its thread state of the calling thread, one of zenoh's, until the process ends.

    Otherwise it would create and delete that state with every frame, because Python did not start the thread; that
    takes longer than the rest of the call.
    """
    ctypes.pythonapi.PyGILState_Ensure()


def listenable() -> str:
    """An endpoint on loopback at a port that is free at present."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
