"""The queue of messages from the link's threads to the loop."""

from __future__ import annotations

import threading
from collections import deque
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Inbox(Generic[Item]):
    """A queue for several producers and one consumer, who may wait with a timeout.

    `queue.SimpleQueue` is not used, because in CPython 3.11 its `get` never returns if a signal interrupts it and the
    timeout has passed by then.
    """

    def __init__(self) -> None:
        self._items: deque[Item] = deque()
        self._there = threading.Lock()
        self._there.acquire()

    def put(self, item: Item) -> None:
        """Add an item and wake the consumer."""
        self._items.append(item)
        try:  # noqa: SIM105 - a context manager would cost more than the rest
            self._there.release()
        except RuntimeError:  # woken already
            pass

    def get(self, timeout: float) -> Item | None:
        """The next item, waiting at most `timeout` s; None where none came, possibly before the timeout has passed."""
        if not self._items and timeout > 0.0:
            self._there.acquire(timeout=timeout)
        try:
            return self._items.popleft()
        except IndexError:
            return None
