"""Frames there and back over the link between two processes of this machine, paced as in a test.

`python -m rths.checkup.exchange master|slave ENDPOINT …`: the master sends a command per interval, and the slave
answers each at once. Both end when their standard input is closed, so that neither outlives the process that started
them. The master prints two lines of JSON: the real-time settings that it was granted, and at the end what it measured,
in s.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import sys
import time
from collections.abc import Callable
from typing import Any, get_type_hints

from common.errors import LostError
from common.host import realtime
from common.host.machine import scheduler_name
from common.link.endpoint import FrameEndpoint, Received
from common.link.zenoh_link import ZenohLink
from common.protocol.messages import Command, Feedback
from common.terminal import cli

TEST = "doctor"
# s, for the other process to answer: both start at once, and imports take many seconds under load.
PATIENCE = 30.0
WARM = 100  # exchanges before those that count: they fill caches, and zenoh sets up its routes
REPEAT = 0.02  # s, between attempts to get the first answer
IDLE = 0.05  # s, after which a process without messages looks whether the doctor has ended: a user does not notice it


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of both processes."""
    parser.add_argument("role", choices=("master", "slave"))
    parser.add_argument("endpoint")
    parser.add_argument("--interval-ns", type=int, default=2_000_000)
    parser.add_argument("--length", type=float, default=1.0, help="length of the measurement, s")
    parser.add_argument("--rt", choices=realtime.MODES, default="auto")
    parser.add_argument("--processor", type=int)


def run(args: argparse.Namespace) -> int:
    """Run one of the two processes."""
    granted = realtime.prepare(args.rt, args.processor)
    if args.role == "master":
        say(granted._asdict() | {"scheduler": scheduler_name()})
    place = {"listen": args.endpoint} if args.role == "master" else {"connect": args.endpoint}
    link = ZenohLink(args.role, TEST, patience=PATIENCE, stopping=unwanted, **place)
    try:
        endpoint = FrameEndpoint(link, TEST)
        endpoint.enter(1)
        if args.role == "slave":
            answer(endpoint)
            return 0
        say(Master(endpoint, args.interval_ns).measure(round(args.length * 1e9)))
    finally:
        link.close()
    return 0


def say(found: dict[str, Any]) -> None:
    """Print one line of JSON for the process that started this one."""
    sys.stdout.write(json.dumps(found) + "\n")
    sys.stdout.flush()


def unwanted() -> str:
    """A sentence where the process that started this one has ended, else empty."""
    ready, _, _ = select.select([0], [], [], 0.0)
    return "The doctor has ended." if ready and not os.read(0, 4096) else ""


def filled(message: type[Any], **values: Any) -> Any:
    """A message with these fields, the others at zero."""
    zeros = {name: hint() for name, hint in get_type_hints(message).items()}
    return message(**zeros | values)


def answer(endpoint: FrameEndpoint) -> None:
    """Answer every command until the starting process has ended."""
    realtime.freeze()
    while not unwanted():
        received = endpoint.receive(IDLE)
        if received is not None and isinstance(received.message, Command):
            seq = received.message.seq
            stamps = {"command_received_ns": received.received_ns, "sent_ns": time.monotonic_ns()}
            endpoint.send(FEEDBACK._replace(seq=seq, command_seq=seq, **stamps))


COMMAND = filled(Command, session=1)
FEEDBACK = filled(
    Feedback, session=1, measured=(0.0,) * 4
)  # as many channels as a shaking table with a damper has


class Master:
    """Sends commands at their times and takes note of when each was answered."""

    def __init__(self, endpoint: FrameEndpoint, interval_ns: int) -> None:
        self._endpoint = endpoint
        self._interval_ns = interval_ns
        self._seq = 0
        self._waiting: dict[int, tuple[int, int]] = {}  # command: its tick's time, when it was sent
        self._wake: list[int] = []
        self._round_trip: list[int] = []
        self._ticks = 0
        self._on_time = 0

    def measure(self, length_ns: int) -> dict[str, Any]:
        """Exchange for a length of time, once the slave answers; counts and percentiles.

        Raises:
            LostError: the slave never answered.
        """
        self._meet()
        realtime.freeze()
        self._pace(time.monotonic_ns() + WARM * self._interval_ns)
        self._forget()
        self._pace(time.monotonic_ns() + length_ns)
        self._hear(time.monotonic_ns() + self._interval_ns, lambda: not self._waiting)
        return {
            "exchanges": self._ticks,
            "late": self._ticks - self._on_time,
            "unanswered": len(self._waiting),
            "wake_lateness": percentiles(self._wake),
            "round_trip": percentiles(self._round_trip),
        }

    def _meet(self) -> None:
        deadline = time.monotonic_ns() + int(PATIENCE * 1e9)
        while not self._round_trip and not unwanted():
            if time.monotonic_ns() > deadline:
                raise LostError(
                    f"The answering process was not heard within {PATIENCE:g} s: check that this machine "
                    "lets programs talk over 127.0.0.1."
                )
            self._send(time.monotonic_ns())
            self._hear(time.monotonic_ns() + int(REPEAT * 1e9), lambda: bool(self._round_trip))

    def _forget(self) -> None:
        self._waiting.clear()
        self._wake.clear()
        self._round_trip.clear()
        self._ticks = self._on_time = 0

    def _pace(self, until_ns: int) -> None:
        """Send a command at every interval; commands whose interval has passed are skipped and count as late."""
        due = time.monotonic_ns() + self._interval_ns
        while due < until_ns and not unwanted():
            self._hear(due, lambda: False)
            now = time.monotonic_ns()
            missed = (now - due) // self._interval_ns
            due += missed * self._interval_ns
            self._ticks += missed + 1
            self._wake.append(now - due + missed * self._interval_ns)
            self._send(due)
            due += self._interval_ns

    def _send(self, due_ns: int) -> None:
        self._seq += 1
        sent = time.monotonic_ns()
        self._waiting[self._seq] = (due_ns, sent)
        self._endpoint.send(COMMAND._replace(seq=self._seq, sent_ns=sent))

    def _hear(self, deadline_ns: int, enough: Callable[[], bool]) -> None:
        """Take answers until a time, including those that have arrived by then."""
        while not enough():
            left = deadline_ns - time.monotonic_ns()
            received = self._endpoint.receive(max(left, 0) * 1e-9)
            if received is not None:
                self._take(received)
            elif left <= 0:
                return

    def _take(self, received: Received) -> None:
        if isinstance(received.message, Feedback) and received.message.command_seq in self._waiting:
            due, sent = self._waiting.pop(received.message.command_seq)
            self._round_trip.append(received.received_ns - sent)
            self._on_time += received.received_ns - due < self._interval_ns


def percentiles(times_ns: list[int]) -> dict[str, float]:
    """The times that these shares did not exceed (nearest rank), s; empty without any."""
    if not times_ns:
        return {}
    ordered = sorted(times_ns)
    shares = (("p50", 500), ("p90", 900), ("p99", 990), ("p99.9", 999), ("max", 1000))
    return {name: ordered[-(-len(ordered) * share // 1000) - 1] / 1e9 for name, share in shares}


def main() -> int:
    """Entry of the process."""
    parser = argparse.ArgumentParser(prog="python -m rths.checkup.exchange")
    add_arguments(parser)
    args = parser.parse_args()
    return cli.guarded(lambda: run(args))


if __name__ == "__main__":
    sys.exit(main())
