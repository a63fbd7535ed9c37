"""The application's watchdog: how many intervals ago the last fresh message came.

The transport's own liveness is not used: eclipse-zenoh notices a dead peer after its lease of a second, when a rig
must have been at rest for long.
"""

from __future__ import annotations

from enum import IntEnum

from common.plan.tables import SafetyTable


class WatchdogFinding(IntEnum):
    """The watchdog's finding at a tick, in the order of severity."""

    FINE = 0
    HOLD = 1
    RAMP = 2


FINE = WatchdogFinding.FINE  # of nearly every tick: an attribute of an enumeration takes 60 ns
ROUND_TRIP = 2  # intervals by which an echo may lag behind a message, because it has travelled both ways


class Watchdog:
    """Counts intervals without a fresh message, and intervals in which the echoed message number did not advance.

    A partner that sends does not necessarily receive: the number of one's own newest message, which its messages echo,
    must advance too, with an allowance of a round trip. Intervals in which this loop itself was late are not counted;
    the limit `overrun` is for those.
    """

    def __init__(self, safety: SafetyTable, interval: float) -> None:
        self._hold, self._ramp = safety.hold_after, safety.ramp_after
        self._age = max(round(safety.message_age / interval), 1)
        self._seq = self._echo = -1
        self._unheard = self._unechoed = 0

    @property
    def missed(self) -> int:
        """Intervals of silence: without a message, or without an echo beyond the allowance."""
        unanswered = self._unechoed - ROUND_TRIP
        return unanswered if unanswered > self._unheard else self._unheard

    def look(self, tick: int, seq: int, echo: int) -> WatchdogFinding:
        """Count an interval: the message of `tick` is due, the newest one has the number `seq` and echoes `echo`.

        The first message may be late by `message_age`, because a link with a delay is not silent.
        """
        fresh = seq > self._seq and tick - seq <= self._age
        if fresh and echo > self._echo >= 0:  # as in nearly every tick
            self._unheard = self._unechoed = 0
            self._seq, self._echo = seq, echo
            return FINE
        self._unheard = 0 if fresh else self._unheard + 1
        self._unechoed = 0 if fresh and echo > self._echo else self._unechoed + 1
        if fresh:
            self._seq, self._echo = seq, max(echo, self._echo)
        begun, missed = self._seq >= 0 and self._echo >= 0, self.missed
        if missed >= (self._ramp if begun else max(self._ramp, self._age)):
            return WatchdogFinding.RAMP
        return WatchdogFinding.HOLD if missed >= self._hold and begun else FINE
