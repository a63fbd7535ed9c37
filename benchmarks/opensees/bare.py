"""`python -m benchmarks.opensees.bare PORT STEPS INTERVAL SHARE`: bare TCP under the same client, every INTERVAL s.

It sends an answer of the same size where `rths serve` hands a force over, and waits for the client's next displacement,
with the same answers between them: no laboratory, no checks, no recording. Prints the times in between, s, as JSON, and
in how many ticks the displacement had not come after SHARE of the interval, by the rule of `rths serve`.
"""

from __future__ import annotations

import json
import select
import socket
import struct
import sys
import time

from common.host import realtime

SIZE = 8 * 256
TRIAL, DAMPING, FORCE = 3.0, 14.0, 10.0


def received(link: socket.socket) -> tuple[float, float]:
    """Code and displacement of the next message."""
    data = b""
    while len(data) < SIZE:
        try:
            data += link.recv(SIZE - len(data))
        except BlockingIOError:
            select.select([link], [], [])
            continue
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
    code, x = struct.unpack_from("=2d", data)
    return code, x


def until_asked(link: socket.socket, place: float) -> tuple[float, int]:
    """Answer dampings until a force is asked for: the displacement, and when it first came, ns."""
    came = 0
    while True:
        code, x = received(link)
        if code == TRIAL and x != place:
            place, came = x, time.monotonic_ns()
        elif code == DAMPING:
            link.send(bytes(SIZE))
        elif code == FORCE:
            return place, came


def missed(tick: int, handed: int, came: int, interval: int, share: int) -> int:
    """The ticks, from `tick` on, that end before a displacement came though the client had half of the share (ns)."""
    fair = -((share // 2 - handed) // interval)  # the first tick in which it had
    return max(0, (came - share) // interval - max(tick, fair) + 1)


def main() -> int:
    """Serve one client."""
    port, steps, interval = int(sys.argv[1]), int(sys.argv[2]), round(float(sys.argv[3]) * 1e9)
    share = round(float(sys.argv[4]) * interval)
    realtime.prepare("auto", None)
    with socket.create_server(("127.0.0.1", port)) as server:
        link, _ = server.accept()
    with link:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        link.recv(44, socket.MSG_WAITALL)
        link.setblocking(False)
        place, _ = until_asked(link, 0.0)
        start, waits, tick, late = time.monotonic_ns(), [], 0, 0
        for _ in range(1, steps):
            tick += 1
            time.sleep(max(start + tick * interval - time.monotonic_ns(), 0) * 1e-9)
            handed = time.monotonic_ns()
            link.send(bytes(SIZE))
            place, came = until_asked(link, place)
            waits.append((came - handed) * 1e-9)
            behind = missed(tick, handed - start, came - start, interval, share)
            tick, late = tick + behind, late + behind
        link.send(bytes(SIZE))
        while link.recv(SIZE) if select.select([link], [], [], 0.2)[0] else b"":
            pass
    sys.stdout.write(json.dumps({"waits": waits, "late": late}) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
