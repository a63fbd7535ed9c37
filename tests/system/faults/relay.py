"""A relay of datagrams between a slave and its master, which can change what passes or keep it."""

from __future__ import annotations

import selectors
import socket
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Self

TO_MASTER, TO_SLAVE = "to master", "to slave"
Change = Callable[[bytes, str], bytes | None]  # datagram and way; None where it is lost
MOST = 1 << 16


def untouched(datagram: bytes, _way: str) -> bytes | None:
    """Everything passes as it is."""
    return datagram


class Relay:
    """Listens on loopback and hands on to `port`; a dialler that comes from another port is another one."""

    def __init__(self, port: int) -> None:
        self.change: Change = untouched
        self._master = ("127.0.0.1", port)
        self._front = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._front.bind(("127.0.0.1", 0))
        self.endpoint = f"udp/127.0.0.1:{self._front.getsockname()[1]}"
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._front, selectors.EVENT_READ, None)
        self._back: dict[tuple[str, int], socket.socket] = {}
        self._closing = False
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing = True
        self._thread.join(10.0)
        for end in (self._front, *self._back.values()):
            end.close()
        self._selector.close()

    def _run(self) -> None:
        while not self._closing:
            for key, _ in self._selector.select(0.1):
                try:
                    self._pass(key.data)
                except ConnectionRefusedError:  # nobody listens there any more
                    continue

    def _pass(self, dialler: tuple[str, int] | None) -> None:
        if dialler is None:
            datagram, address = self._front.recvfrom(MOST)
            changed = self.change(datagram, TO_MASTER)
            if changed is not None:
                self._towards(address).sendto(changed, self._master)
        else:
            changed = self.change(self._back[dialler].recv(MOST), TO_SLAVE)
            if changed is not None:
                self._front.sendto(changed, dialler)

    def _towards(self, dialler: tuple[str, int]) -> socket.socket:
        if dialler not in self._back:
            end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            end.bind(("127.0.0.1", 0))
            self._back[dialler] = end
            self._selector.register(end, selectors.EVENT_READ, dialler)
        return self._back[dialler]
