"""The application's watchdog: how many intervals ago the last fresh message came.

The transport's own liveness is not asked: eclipse-zenoh notices a dead peer after its lease, long after a rig
has to be at rest.
"""

from __future__ import annotations

from enum import Enum

from common.tables import Safety


class Finding(Enum):
    """What the watchdog wants at a tick."""

    FINE = "fine"
    HOLD = "hold"
    RAMP = "ramp"


class Watchdog:
    """Counts own intervals without a fresh message.

    A message is fresh where both its number and the number it echoes are ahead of those before: that the other end
    speaks does not show that it hears. Intervals in which the own loop came too late are not counted; the
    limit `overrun` is for those.
    """

    def __init__(self, safety: Safety, interval: float) -> None:
        self._hold, self._ramp = safety.hold_after, safety.ramp_after
        self._age = max(round(safety.message_age / interval), 1)
        self._seq = self._echo = -1
        self.missed = 0

    def look(self, tick: int, seq: int, echo: int) -> Finding:
        """One interval: the tick whose message is due, the newest one's own number, and the one it echoes.

        Before the first message has come it may be as late as a message may be old: a link's delay is no silence.
        """
        if seq > self._seq and echo > self._echo and tick - seq <= self._age:
            self._seq, self._echo, self.missed = seq, echo, 0
            return Finding.FINE
        self.missed += 1
        if self.missed >= (self._ramp if self._seq >= 0 else max(self._ramp, self._age)):
            return Finding.RAMP
        return Finding.HOLD if self.missed >= self._hold and self._seq >= 0 else Finding.FINE
