"""Frames on their way from the link's threads to the loop."""

from __future__ import annotations

import contextlib
import threading
from collections import deque

from common.transport import Packet


class Inbox:
    """A queue for several producers and one consumer, who may wait with a timeout.

    Not `queue.SimpleQueue`: in CPython 3.11 its `get` waits for ever where a signal interrupts it and the
    timeout has passed by then.
    """

    def __init__(self) -> None:
        self._packets: deque[Packet] = deque()
        self._there = threading.Lock()
        self._there.acquire()

    def put(self, packet: Packet) -> None:
        """Add a frame and wake the consumer."""
        self._packets.append(packet)
        with contextlib.suppress(RuntimeError):  # woken already
            self._there.release()

    def get(self, timeout: float) -> Packet | None:
        """The next frame, waiting at most `timeout` s; None where none came, or earlier on a false alarm."""
        if not self._packets and timeout > 0.0:
            self._there.acquire(timeout=timeout)
        try:
            return self._packets.popleft()
        except IndexError:
            return None
