"""What strangers send to the master's port: garbage, and connections that are never used."""

from __future__ import annotations

import contextlib
import random
import socket
import sys
import time
from collections.abc import Iterator

PAUSE = 0.002  # s between two steps of a stranger


class Stranger:
    """Sends to a port of this machine what no process of ours would."""

    def __init__(self, port: int, seed: int = 1) -> None:
        self._place = ("127.0.0.1", port)
        self._noise = random.Random(seed)

    def datagrams(self, count: int) -> None:
        """So many datagrams of garbage."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
            for number in range(count):
                with contextlib.suppress(OSError):  # nobody listens there
                    end.sendto(self._garbage(1400), self._place)
                if number % 10 == 0:
                    time.sleep(PAUSE)

    def connections(self, count: int) -> None:
        """So many connections with garbage."""
        for _ in range(count):
            with contextlib.suppress(OSError), self._connected() as end:  # closed by the other end
                end.sendall(self._garbage(2000))
            time.sleep(PAUSE)

    @contextlib.contextmanager
    def held(self, count: int) -> Iterator[None]:
        """So many connections on which nothing is said, open at the same time."""
        with contextlib.ExitStack() as stack:
            for _ in range(count):
                stack.enter_context(self._connected())
                time.sleep(PAUSE)
            yield

    def _connected(self) -> socket.socket:
        return socket.create_connection(self._place, timeout=0.5)

    def _garbage(self, most: int) -> bytes:
        return self._noise.randbytes(self._noise.randrange(1, most))


if __name__ == "__main__":
    Stranger(int(sys.argv[1])).datagrams(int(sys.argv[2]))
