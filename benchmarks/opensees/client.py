"""The socket protocol of an OpenSees element in plain Python: `python client.py PORT STEPS` makes this many steps.

A step is that of NewmarkExplicit (docs/decisions/0043-outer-building.md). It runs as a script, without this project.
"""

from __future__ import annotations

import math
import socket
import struct
import sys
import time

HOST, DATA, STEP = "127.0.0.1", 256, 0.002
TRIAL, COMMIT, FORCE, DAMPING, END = 3.0, 5.0, 10.0, 14.0, 99.0


def connected(port: int) -> socket.socket:
    """A connection to whoever serves, waited for."""
    end = time.monotonic() + 60.0
    while True:
        one = socket.socket()
        if not one.connect_ex((HOST, port)):
            break
        one.close()
        if time.monotonic() > end:
            raise TimeoutError("nobody serves")
        time.sleep(0.05)
    one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    one.sendall(struct.pack("=11i", 1, 1, 1, 0, 1, 0, 0, 0, 1, 0, DATA))
    return one


def say(link: socket.socket, code: float, x: float, t: float) -> None:
    """Send a message."""
    link.sendall(struct.pack("=5d", code, x, 0.0, 0.0, t).ljust(8 * DATA, b"\0"))


def answer(link: socket.socket) -> float:
    """The first number of the next answer."""
    data = b""
    while len(data) < 8 * DATA:
        piece = link.recv(8 * DATA - len(data))
        if not piece:
            raise ConnectionError("the server has closed the connection")
        data += piece
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
    return float(struct.unpack_from("=d", data)[0])


def make_step(link: socket.socket, x: float, t: float) -> None:
    """One step to a displacement (m) at a time (s)."""
    say(link, TRIAL, x, t)
    for code in (DAMPING, FORCE, DAMPING):
        say(link, code, x, t)
        answer(link)
    say(link, TRIAL, x, t)
    say(link, COMMIT, x, t)


def main() -> int:
    """Make the steps, and print how many a second."""
    port, steps = int(sys.argv[1]), int(sys.argv[2])
    link = connected(port)
    began = 0.0
    for i in range(1, steps + 1):
        make_step(link, 1e-3 * math.sin(0.02 * i), STEP * i)
        began = began or time.perf_counter()  # the first step waits until the laboratories are armed
    sys.stdout.write(f'{{"rate": {(steps - 1) / (time.perf_counter() - began)}}}\n')
    say(link, END, 0.0, 0.0)
    link.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
