"""Messages that a link plug-in delays or loses, handed out tick by tick.

A message with the extra delay d is available from the first tick at or after its nominal time plus d. Of several
available messages the newest is used, and none is used after a newer one.
"""

from __future__ import annotations

import math
from typing import Generic, Protocol, TypeVar

Frame = TypeVar("Frame")


class LinkModel(Protocol):
    """A link plug-in, constructed as `Class(seed=…, **options)`.

    The watchdogs see its delays and losses, unless its class sets `watched = False`: then they see the messages as they
    came over the real link, and a test over an emulated network goes on however bad that network is.
    """

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        """Extra delay (s) of the message of tick `seq`, sent at test time `t` (s); None if it is lost."""


class PerfectLink:
    """No delay, no loss."""

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        """No extra delay."""
        return 0.0


def ticks_late(extra: float, interval: float) -> int:
    """By how many ticks an extra delay (s) postpones a message.

    A billionth of an interval is allowed, so that rounding does not turn a delay of whole intervals into one more.
    """
    return math.ceil(extra / interval - 1e-9) if extra > 0.0 else 0


class Mailbox(Generic[Frame]):
    """Receiving end of one direction; a message is used `nominal` ticks after its own without any extra delay."""

    def __init__(self, link: LinkModel, direction: str, interval: float, nominal: int) -> None:
        self._link = link
        self._direction = direction
        self._interval = interval
        self._nominal = nominal
        self._waiting: list[tuple[int, int, Frame]] = []
        self._watched = getattr(link, "watched", True)
        self._newest: Frame | None = None  # newest message that came over the real link
        self.newest_seen = -1
        self._taken = -1

    def put(self, seq: int, frame: Frame) -> float | None:
        """Take in the message of the tick `seq` from the real link; returns its extra delay (s), None if it is lost."""
        if seq > self.newest_seen:
            self.newest_seen, self._newest = seq, frame
        extra = self._link.fate(self._direction, seq, seq * self._interval)
        if extra is not None:
            ticks = ticks_late(extra, self._interval) if extra else 0
            self._waiting.append((seq + self._nominal + ticks, seq, frame))
        return extra

    def judged(self, used: Frame) -> Frame:
        """The message that a watchdog judges.

        The one in use, or for an unwatched plug-in the newest of the real link.
        """
        return used if self._watched or self._newest is None else self._newest

    def take(self, tick: int) -> Frame | None:
        """The newest message available at this tick; None where none is newer than the last one taken."""
        if not self._waiting:
            return None
        if len(self._waiting) == 1 and self._waiting[0][0] <= tick and self._waiting[0][1] > self._taken:
            _, self._taken, frame = self._waiting.pop()
            return frame
        newest: tuple[int, int, Frame] | None = None
        for entry in self._waiting:
            if entry[0] <= tick and entry[1] > (newest[1] if newest else self._taken):
                newest = entry
        if newest is None:
            return None
        self._taken = newest[1]
        self._waiting = [entry for entry in self._waiting if entry[1] > self._taken]
        return newest[2]
