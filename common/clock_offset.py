"""The offset between two clocks from exchanges of time stamps.

Each exchange gives four stamps: t1 sent and t4 received by one clock, t2 received and t3 sent by the
other. Offset `((t2 − t1) + (t3 − t4))/2` is wrong by at most half the round trip `(t4 − t1) − (t3 − t2)`
(RFC 5905), so the exchange with the shortest round trip of a recent window is believed.
"""

from __future__ import annotations

from collections import deque


class ClockOffset:
    """Estimate of (other clock − own clock), ns, and its bound; the newest `blocks` of `length` exchanges count."""

    def __init__(self, *, length: int = 50, blocks: int = 10) -> None:
        self._length = length
        self._minima: deque[tuple[int, int]] = deque(maxlen=blocks)
        self._in_block = length
        self.offset = 0  # other clock minus own clock, ns
        self.bound = 0  # largest error of it, ns: half the shortest round trip; asymmetry cannot be seen

    def add(self, t1: int, t2: int, t3: int, t4: int) -> None:
        """Take in one exchange."""
        pair = ((t4 - t1) - (t3 - t2), ((t2 - t1) + (t3 - t4)) // 2)
        self._in_block += 1
        if self._in_block > self._length:
            self._minima.append(pair)
            self._in_block = 1
        elif pair < self._minima[-1]:
            self._minima[-1] = pair
        else:
            return
        shortest, self.offset = min(self._minima)
        self.bound = max(shortest, 0) // 2
