"""A client of `rths serve` that fails: `python failing.py PORT STEPS HOW` makes so many steps, then fails as HOW says.

It prints the time (Unix, ns) of its last message as JSON before it fails. Where HOW is `second`, it does not fail: a
second client connects beside it, and it prints after how many ms the server closed that connection. It runs as a script
that imports client.py alone: a process with more threads and memory takes longer to die, and its connection is closed
that much later.
"""

from __future__ import annotations

import json
import math
import os
import signal
import socket
import struct
import sys
import time
from importlib import import_module
from typing import Any

client: Any = import_module("client" if __name__ == "__main__" else "benchmarks.opensees.client")


def killed(_: socket.socket, _port: int, _steps: int) -> None:
    """The process is killed; the system closes the connection."""
    os.kill(os.getpid(), signal.SIGKILL)


def stalled(link: socket.socket, _port: int, _steps: int) -> None:
    """It says nothing more until the server closes the connection."""
    link.recv(1)


def malformed(link: socket.socket, _port: int, _steps: int) -> None:
    """It sends what is no message."""
    link.sendall(struct.pack("=d", 42.0).ljust(8 * client.DATA, b"\0"))
    link.recv(1)


def diverged(link: socket.socket, _port: int, _steps: int) -> None:
    """It sends a displacement that is not a number."""
    client.say(link, client.TRIAL, math.nan, 0.0)
    link.recv(1)


def second(link: socket.socket, port: int, steps: int) -> None:
    """A second client connects while this one goes on for as many steps again, and ends in order."""
    other = client.connected(port)
    other.setblocking(False)
    began, closed = time.perf_counter(), 0.0
    for i in range(steps + 1, 2 * steps + 1):
        client.make_step(link, 1e-3 * math.sin(0.02 * i), client.STEP * i)
        if not closed and is_closed(other):
            closed = time.perf_counter()
    client.say(link, client.END, 0.0, 0.0)
    if closed:
        sys.stdout.write(json.dumps({"closed_ms": 1e3 * (closed - began)}) + "\n")


def is_closed(link: socket.socket) -> bool:
    """Whether the other end has closed a connection."""
    try:
        return not link.recv(1)
    except BlockingIOError:
        return False
    except ConnectionError:
        return True


WAYS = {way.__name__: way for way in (killed, stalled, malformed, diverged, second)}


def main() -> int:
    """Make the steps and fail."""
    port, steps, how = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    link = client.connected(port)
    for i in range(1, steps + 1):
        client.make_step(link, 1e-3 * math.sin(0.02 * i), client.STEP * i)
    client.say(link, client.DAMPING, 0.0, 0.0)  # its answer tells that the commit was read
    client.answer(link)
    sys.stdout.write(json.dumps({"last_ns": time.time_ns()}) + "\n")
    sys.stdout.flush()
    WAYS[how](link, port, steps)
    return 0


if __name__ == "__main__":
    sys.exit(main())
