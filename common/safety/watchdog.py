"""The application's watchdog: how many intervals ago the last fresh message came.

The transport's own liveness is not asked: eclipse-zenoh notices a dead peer after its lease, long after a rig
has to be at rest.
"""

from __future__ import annotations

from enum import IntEnum

from common.plan.tables import SafetyTable


class WatchdogFinding(IntEnum):
    """What the watchdog wants at a tick; the worse, the higher."""

    FINE = 0
    HOLD = 1
    RAMP = 2


ROUND_TRIP = 2  # intervals that an echo may be later than a message: it has gone both ways


class Watchdog:
    """Counts own intervals without a fresh message, and those in which the echo of one's own has not moved.

    A partner that sends does not necessarily receive: the number that its messages echo must advance as well, with a
    round trip of allowance. Intervals in which the own loop came too late are not counted; the limit `overrun`
    is for those.
    """

    def __init__(self, safety: SafetyTable, interval: float) -> None:
        self._hold, self._ramp = safety.hold_after, safety.ramp_after
        self._age = max(round(safety.message_age / interval), 1)
        self._seq = self._echo = -1
        self._unheard = self._unechoed = 0

    @property
    def missed(self) -> int:
        """Intervals of silence, by messages or by echoes beyond their round trip."""
        unanswered = self._unechoed - ROUND_TRIP
        return unanswered if unanswered > self._unheard else self._unheard

    def look(self, tick: int, seq: int, echo: int) -> WatchdogFinding:
        """One interval: the tick whose message is due, the newest one's own number, and the one it echoes.

        Until the first message has come, it may be as late as a message may be old: the delay of a link is not
        silence.
        """
        fresh = seq > self._seq and tick - seq <= self._age
        if fresh and echo > self._echo >= 0:  # as in nearly every tick
            self._unheard = self._unechoed = 0
            self._seq, self._echo = seq, echo
            return WatchdogFinding.FINE
        self._unheard = 0 if fresh else self._unheard + 1
        self._unechoed = 0 if fresh and echo > self._echo else self._unechoed + 1
        if fresh:
            self._seq, self._echo = seq, max(echo, self._echo)
        begun, missed = self._seq >= 0 and self._echo >= 0, self.missed
        if missed >= (self._ramp if begun else max(self._ramp, self._age)):
            return WatchdogFinding.RAMP
        return WatchdogFinding.HOLD if missed >= self._hold and begun else WatchdogFinding.FINE
