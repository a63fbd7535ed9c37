"""The link over eclipse-zenoh; the only file that imports it.

The master's session routes, so that a slave and a recorder that only dial the master also hear each
other. One publisher per channel, express, at real-time priority, dropped rather than blocked when the
network is congested: a late frame is worth nothing, and a blocked loop would be a fault (docs/decisions).
"""

from __future__ import annotations

import json
import socket
import time
from queue import Empty, SimpleQueue

import zenoh

from common.errors import InputError, LostError
from common.transport import CONTROL, HEARD, SAMPLES, TICK, Packet

LEASE_MS = 1000
PREFIX = "rths"


def configuration(role: str, listen: str, connect: str) -> zenoh.Config:
    """Configuration of one role: no discovery, one static link, short lease, constant retry."""
    config = zenoh.Config()
    settings: dict[str, object] = {
        "mode": "router" if role == "master" else "client",
        "listen/endpoints": [listen] if listen else [],
        "connect/endpoints": [connect] if connect else [],
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
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


class ZenohLink:
    """One role's access to the link of a test; `listen` and `connect` are zenoh endpoints (tcp/host:port)."""

    def __init__(self, role: str, test: str, *, listen: str = "", connect: str = "") -> None:
        zenoh.init_log_from_env_or("off")
        self._packets: SimpleQueue[Packet] = SimpleQueue()
        try:
            self._session = zenoh.open(configuration(role, listen, connect))
        except zenoh.ZError as error:
            raise self._refusal(listen, connect, error) from None
        self._publishers = {
            channel: self._session.declare_publisher(
                f"{PREFIX}/{test}/{role}/{channel}",
                express=channel != SAMPLES,
                priority=zenoh.Priority.DATA if channel == SAMPLES else zenoh.Priority.REAL_TIME,
                congestion_control=zenoh.CongestionControl.DROP,
                reliability=zenoh.Reliability.RELIABLE,
            )
            for channel in (TICK, CONTROL, SAMPLES)
        }
        self._subscribers = [
            self._session.declare_subscriber(f"{PREFIX}/{test}/{other}/{channel}", self._hear(other, channel))
            for other, channel in HEARD[role]
        ]

    @staticmethod
    def _refusal(listen: str, connect: str, error: Exception) -> Exception:
        if listen:
            return InputError(
                f"Cannot listen on {listen}: the port is in use or the address is not this machine's; "
                f"choose another with --listen."
            )
        return LostError(f"Cannot open the link to {connect}: {error}")

    def _hear(self, role: str, channel: str):  # type: ignore[no-untyped-def]
        put = self._packets.put
        now = time.monotonic_ns

        def heard(sample: zenoh.Sample) -> None:
            put(Packet(role, channel, sample.payload.to_bytes(), now()))

        return heard

    def send(self, channel: str, frame: bytes) -> None:
        """Hand a frame to the link; dropped where the network is congested."""
        self._publishers[channel].put(frame)

    def receive(self, timeout: float) -> Packet | None:
        """The next frame, waiting at most `timeout` s; None where none came."""
        try:
            return self._packets.get(block=timeout > 0.0, timeout=timeout if timeout > 0.0 else None)
        except Empty:
            return None

    def close(self) -> None:
        """Leave the link; without it, zenoh's threads would keep the process alive."""
        self._session.close()  # type: ignore[no-untyped-call]


def listenable() -> str:
    """An endpoint on loopback at a port that nobody uses now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
