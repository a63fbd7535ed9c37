"""A UDP socket that is connected to one address and is read until a deadline."""

from __future__ import annotations

import re
import select
import socket
import time
import weakref

from common.errors import InputError
from common.udp.packets import SIZE

ADDRESS = re.compile(r"udp/(?:([^:/\s]+):)?(\d{1,5})")
LOOPBACK = "127.0.0.1"


def place(address: str, where: str) -> tuple[str, int]:
    """Host and port of 'udp/HOST:PORT', or of 'udp/PORT' on this machine; `where` names the plan's table in errors.

    Raises:
        InputError: the address has another form.
    """
    found = ADDRESS.fullmatch(address)
    if found is None or not 0 < int(found[2]) < 65536:
        raise InputError(
            f"address in {where} is '{address}', but must be udp/HOST:PORT, or udp/PORT on this machine."
        )
    return found[1] or LOOPBACK, int(found[2])


class Peer:
    """The socket; the operating system discards packets from other addresses.

    Raises:
        InputError: the host has no IPv4 address.
    """

    def __init__(self, address: str, where: str) -> None:
        host, port = place(address, where)
        self.refused = False  # whether the other machine reported that nothing listens at the port
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.close = weakref.finalize(self, self._socket.close)
        self._socket.setblocking(False)
        try:
            self._socket.connect((host, port))
        except OSError as error:
            self.close()
            raise InputError(
                f"address in {where} is '{address}', which cannot be used: {error.strerror}."
            ) from None

    def send(self, packet: bytes) -> None:
        """Send a packet; if the system cannot send it, it is lost, as a packet may be lost on the network."""
        try:
            self._socket.send(packet)
        except ConnectionRefusedError:
            self.refused = True
        except OSError:  # no buffer, no route
            pass

    def receive(self, deadline: int) -> bytes | None:
        """The next packet, None if none arrives before `deadline` (ns of the monotonic clock)."""
        while True:
            try:
                packet = self._socket.recv(SIZE + 1)
            except BlockingIOError:
                left = deadline - time.monotonic_ns()
                if left <= 0 or not select.select([self._socket], [], [], left * 1e-9)[0]:
                    return None
            except OSError:
                self.refused = True
                if time.monotonic_ns() >= deadline:
                    return None
            else:
                self.refused = False
                return packet
