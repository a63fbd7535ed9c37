"""A rig in a process of its own, in Python without other libraries: one UDP packet each way per tick.

Try it:    python examples/udp_rig.py --listen 127.0.0.1:9100      and, in a second terminal,
           rths run examples/udp_rig.toml --virtual

`Column` is the rig; replace it by one that moves your hardware. `Server` answers the packets, and stops the rig if
they no longer arrive. docs/reference/udp-rig.md has the layout of the packets; examples/udp_rig.c is the same in C.
"""

from __future__ import annotations

import argparse
import math
import select
import socket
import struct
import time
import zlib
from collections.abc import Callable, Sequence
from typing import Any

REQUEST = struct.Struct("<4sHHIIddQHHI8d12sI")
ANSWER = struct.Struct("<4sHHIIIHH8d36sI")
SIZE, CHECKED = 128, 124
ECHO, ARM, COMMAND, DISARM = 1, 2, 3, 4  # kinds of packets
IDLE, PREPARING, READY, RUNNING, STOPPED, EMERGENCY = range(6)  # states of the rig
CHANNELS = "actuator_command m;column_displacement m;column_force N"


class Column:
    """An actuator that lags by 11 ms and a column of 12.5 kN/mm."""

    def __init__(self, interval: float, seed: int) -> None:
        # share of the remaining way that the lag covers in an eighth of an interval
        self._part = 1.0 - math.exp(-interval / 8.0 / 0.011)
        self._position = self._command = 0.0

    def arm(self) -> None:
        """Prepare to move; raise an exception with the reason if that is not possible."""

    def read(self) -> tuple[float, ...]:
        """Deformation (m) and force (N) now."""
        return self._position, 12.5e6 * self._position

    def write(self, command: Sequence[float]) -> None:
        """Ramp to the command (m) over the coming interval. Hardware returns when that interval is over."""
        start, self._command = self._command, command[0]
        for i in range(1, 9):
            wanted = start + (self._command - start) * i / 8.0
            self._position += self._part * (wanted - self._position)

    def disarm(self) -> None:
        """Stop safely; also called when no packet has arrived for too long."""


class Server:
    """Answers packets for a rig; `build` creates it from interval (s) and seed when a test arms it."""

    def __init__(self, build: Callable[[float, int], Any], channels: str = CHANNELS) -> None:
        self._build, self._channels = build, zlib.crc32(channels.encode())
        self._rig: Any = None
        self._state, self._text = IDLE, ""
        self._session = self._seq = 0
        self._silence = 0.0
        self._packet = b""  # the answer to the last packet other than an echo
        self._heard = time.monotonic()

    def answer(self, packet: bytes) -> bytes:
        """The answer to a packet; empty if the packet is damaged, old, or of another test."""
        if len(packet) != SIZE or zlib.crc32(packet[:CHECKED]) != int.from_bytes(packet[CHECKED:], "little"):
            return b""
        magic, version, kind, session, seq, interval, silence, seed, _, count, *rest = REQUEST.unpack(packet)
        if magic != b"RTHR" or version != 1:
            return b""
        if kind == ECHO:  # a rig with real sensors should answer with its readings here as well
            return self._filled(kind, session, seq)
        if kind == ARM and session != self._session and self._state not in (READY, RUNNING):
            self._session, self._seq, self._silence = session, 0, silence
            self._rig = self._build(interval, seed)
        if session != self._session:
            return self._filled(kind, session, seq, IDLE, "busy with another test") if kind == ARM else b""
        self._heard = time.monotonic()
        if seq > self._seq:
            self._seq = seq
            if rest[0] == self._channels:
                self._do(kind, rest[1 : 1 + count])
            else:
                self._state, self._text = STOPPED, "other channels than in the plan"
            measured = () if kind == DISARM else tuple(self._rig.read())
            self._packet = self._filled(kind, session, seq, measured=measured)
        return self._packet if seq == self._seq else b""  # a packet that is sent twice is answered twice

    def _do(self, kind: int, values: Sequence[float]) -> None:
        try:
            if kind == ARM:
                self._rig.arm()
                self._state, self._text = READY, ""
            elif kind == COMMAND and self._state in (READY, RUNNING):
                self._rig.write(values)
                self._state = RUNNING
            elif kind == DISARM:
                self._rig.disarm()
                self._state = IDLE
        except Exception as error:
            self._stop(str(error))

    def _stop(self, why: str) -> None:
        self._state, self._text = STOPPED, why
        self._rig.disarm()

    def look(self) -> None:
        """Stop a running rig if no packet has arrived for too long."""
        if self._state == RUNNING and time.monotonic() - self._heard > self._silence:
            self._stop(f"no packet for {self._silence * 1e3:.0f} ms")

    def _filled(
        self,
        kind: int,
        session: int,
        seq: int,
        state: int | None = None,
        text: str | None = None,
        measured: Sequence[float] = (),
    ) -> bytes:
        values = [*measured, *[0.0] * (8 - len(measured))]
        said = (self._text if text is None else text).encode()[:36]
        state = self._state if state is None else state
        head = (b"RTHA", 1, kind, session, seq, self._channels, state, len(measured))
        body = ANSWER.pack(*head, *values, said, 0)[:CHECKED]
        return body + zlib.crc32(body).to_bytes(4, "little")


def serve(server: Server, place: socket.socket, running: Callable[[], bool] = lambda: True) -> None:
    """Answer packets at a socket while `running`."""
    while running():
        if select.select([place], [], [], 0.005)[0]:
            packet, whence = place.recvfrom(SIZE + 1)
            if answer := server.answer(packet):
                place.sendto(answer, whence)
        server.look()


def main() -> None:
    """Serve the rig at an address."""
    parser = argparse.ArgumentParser(description="A rig in a process of its own.")
    parser.add_argument("--listen", default="127.0.0.1:9100", metavar="HOST:PORT")
    host, _, port = parser.parse_args().listen.partition(":")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as place:
        place.bind((host, int(port)))
        serve(Server(Column), place)


if __name__ == "__main__":
    main()
