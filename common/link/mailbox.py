"""Messages that a link plug-in delays or loses, handed out tick by tick.

A message with the extra delay d is there from the first tick at or after its nominal time plus d; a
newer one wins over an older (contract, section 3).
"""

from __future__ import annotations

import math
from typing import Generic, Protocol, TypeVar

Frame = TypeVar("Frame")


class LinkModel(Protocol):
    """A link plug-in, constructed as `Class(seed=…, **options)`.

    The watchdogs see what it does, unless it says `watched = False`: then they see the messages as they came over the
    real link, and a test over an emulated network goes on however bad that is.
    """

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        """Seconds of extra delay of a message sent at test time `t`, None for lost."""


class PerfectLink:
    """No delay, no loss."""

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        """No extra delay."""
        return 0.0


def ticks_late(extra: float, interval: float) -> int:
    """How many ticks later a message is there for an extra delay (s)."""
    return math.ceil(extra / interval - 1e-9) if extra > 0.0 else 0


class Mailbox(Generic[Frame]):
    """Receiving end of one direction. `nominal` is how many ticks after its own a message is used."""

    def __init__(self, link: LinkModel, direction: str, interval: float, nominal: int) -> None:
        self._link = link
        self._direction = direction
        self._interval = interval
        self._nominal = nominal
        self._waiting: list[tuple[int, int, Frame]] = []
        self._watched = getattr(link, "watched", True)
        self._newest: Frame | None = None  # that came over the wire
        self.newest_seen = -1
        self._taken = -1

    def put(self, seq: int, frame: Frame) -> float | None:
        """Take in a message of the tick `seq` as it comes from the wire; its extra delay (s), None for lost."""
        if seq > self.newest_seen:
            self.newest_seen, self._newest = seq, frame
        extra = self._link.fate(self._direction, seq, seq * self._interval)
        if extra is not None:
            ticks = ticks_late(extra, self._interval)
            self._waiting.append((seq + self._nominal + ticks, seq, frame))
        return extra

    def judged(self, used: Frame) -> Frame:
        """The message that a watchdog judges: the one in use, or the newest of the wire behind an unwatched link."""
        return used if self._watched or self._newest is None else self._newest

    def take(self, tick: int) -> Frame | None:
        """The newest message that is there at this tick; None where there is none newer than the last."""
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
