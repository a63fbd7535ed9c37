"""The offset between two clocks from exchanges of time stamps: a line for its value, an interval for its error.

Each exchange gives four stamps: t1 sent and t4 received by one clock, t2 received and t3 sent by the
other. With the round trip r = (t4 − t1) − (t3 − t2) the offset m = ((t2 − t1) + (t3 − t4))/2 at the time
(t1 + t4)/2 is wrong by at most h = r/2 (RFC 5905), and by drift (t4 − t1)/2 more where the clocks drift apart.

Bound: the offset lies in m ± h at each exchange, and wanders off by `MAX_DRIFT` at most, so it lies in all
those intervals at once, each widened by `MAX_DRIFT` times its age (Marzullo's intersection with the dispersion of
RFC 5905). One interval carries all of them from time to time. No straight line is assumed.

Value: the exchange with the shortest round trip of each block (the clock filter of RFC 5905) is a point of a
straight line, fitted by least squares. Its weight 1/(1 + 4 (h − h₀)/h₀)², h₀ the shortest h, falls with what the
exchange waited in queues (Veitch, Ridoux and Korada 2009), so a congested second does not tilt the line; the
delay that all have in common weighs nothing, it shifts the line and does not tilt it (Moon, Skelly and Towsley
1999). The slope is held to zero by a ridge as strong as one point wrong by h₀ against a drift of
`MAX_DRIFT`, until the window is long enough to tell a drift from delays. A value outside the interval is
moved to its edge.

What cannot be known: an asymmetry of the two directions looks like an offset. Half of it is in the value, and the
bound holds it: no bound can fall below half the sum of the shortest delays there and back, and this one does not.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

MAX_DRIFT = 200e-6  # ns per ns: two crystals of 100 ppm each
# A round trip below minus this share of t4 − t1 is rejected: a drift of `MAX_DRIFT` could make it negative by 2e-4 of
# that time only, so its stamps must be wrong.
IMPOSSIBLE = 0.5
RESOLUTION = 1.0  # ns: the rounding of four integer stamps, halved as the offset is half their sum
# How fast the weight of a minimum falls: one that waited h₀/4 longer in queues than the best has a quarter of its
# weight.
QUEUED = 4.0


class Minimum(NamedTuple):
    """The exchange of a block with the shortest round trip; `time` and `offset` relative to the first one's, ns."""

    time: float
    offset: float
    reach: float  # largest error of the offset


class ClockOffset:
    """Estimate of (other clock − own clock), ns, from the minima of the newest `blocks` of `length` exchanges each.

    Before the first exchange, offset and bound are 0; in the first block the shortest exchange so far gives them.
    With an exchange per tick of 2 ms the defaults make a block of 0.1 s, in which one exchange without a queue is to be
    expected, and a window of 2 s, in which the drift of a crystal is constant.
    """

    def __init__(self, *, length: int = 50, blocks: int = 20) -> None:
        self._length = length
        self._minima: deque[Minimum] = deque(maxlen=blocks)
        self._best = (0.0, 0.0, 0.0)  # the minimum of the present block so far
        self._shortest = math.inf
        self._in_block = 0
        self._newest = 0
        # stamps of months in ns do not fit a float: floats are relative to the first exchange
        self._origin: tuple[int, int] | None = None  # own time, offset
        self._centre, self._level, self._slope = 0.0, 0.0, 0.0  # the line: level at centre
        self._seen, self._low, self._high = 0.0, -math.inf, math.inf  # the interval at the time `seen`
        self._asked: int | None = None  # time of the last call of `at` since the newest exchange
        self._value = 0  # what that call returned

    @property
    def offset(self) -> int:
        """Other clock minus own clock when the newest exchange came back, ns."""
        return self.at(self._newest)

    @property
    def bound(self) -> int:
        """Largest possible error of `offset`, ns."""
        return self.bound_at(self._newest)

    @property
    def drift(self) -> float:
        """Slope of the line, ns per ns; 0 before two blocks are complete."""
        return self._slope

    def at(self, now_ns: int) -> int:
        """Other clock minus own clock at a time of the own clock, ns."""
        if self._origin is None:
            return 0
        if now_ns == self._asked:  # a loop asks several times for the same moment
            return self._value
        start, first = self._origin
        now = now_ns - start
        value = self._level + self._slope * (now - self._centre)
        wander = MAX_DRIFT * abs(now - self._seen)
        low, high = self._low - wander, self._high + wander
        found = first + round(low if value < low else high if value > high else value)
        self._asked, self._value = now_ns, found
        return found

    def bound_at(self, now_ns: int) -> int:
        """Largest possible error of `at`, ns; grows by `MAX_DRIFT` and the slope until the next minimum is seen.

        It holds for any drift within ± `MAX_DRIFT`, a changing one too. Where the intervals contradict each other,
        because a clock ran faster or was set, the newest one alone counts.
        """
        if self._origin is None:
            return 0
        start, first = self._origin
        wander = MAX_DRIFT * abs(now_ns - start - self._seen)
        value = self.at(now_ns) - first
        above, below = self._high - value, value - self._low
        return math.ceil((above if above > below else below) + wander)

    def add(self, t1: int, t2: int, t3: int, t4: int) -> None:
        """Take in one exchange; stamps in ns. An exchange received before it was sent is ignored."""
        trip = (t4 - t1) - (t3 - t2)
        if trip < -IMPOSSIBLE * (t4 - t1) - RESOLUTION:
            return
        self._newest, self._asked = t4, None
        if trip <= self._shortest:  # of equal ones the newest
            self._shortest = trip
            self._keep(t1, t4, trip, t2 - t1 + t3 - t4)
        self._in_block += 1
        if self._in_block >= self._length:
            self._minima.append(Minimum(*self._best))
            self._shortest, self._in_block = math.inf, 0
            self._fit()

    def _keep(self, t1: int, t4: int, trip: int, twice: int) -> None:
        """Take an exchange as the best one of its block so far; `twice` is double its offset, ns.

        The interval, widened to hold at the time of the exchange, is intersected with that of the exchange.
        """
        if self._origin is None:
            self._origin = ((t1 + t4) // 2, twice // 2)
        start, first = self._origin
        error = trip + MAX_DRIFT * (t4 - t1)
        reach = error / 2 + RESOLUTION if error > 0.0 else RESOLUTION
        time, offset = (t1 + t4 - 2 * start) / 2, (twice - 2 * first) / 2
        self._best = time, offset, reach
        if not self._minima:
            self._centre, self._level = time, offset
        wander = MAX_DRIFT * abs(time - self._seen)
        low, high = offset - reach, offset + reach
        oldest, latest = self._low - wander, self._high + wander
        if oldest <= high and low <= latest:
            low, high = oldest if oldest > low else low, latest if latest < high else high
        self._seen, self._low, self._high = time, low, high

    def _fit(self) -> None:
        """The line through the minima."""
        least = min(item.reach for item in self._minima)
        weights = [(1.0 + QUEUED * (item.reach / least - 1.0)) ** -2 for item in self._minima]
        total = sum(weights)
        pairs = list(zip(weights, self._minima, strict=True))
        centre = sum(weight * item.time for weight, item in pairs) / total
        level = sum(weight * item.offset for weight, item in pairs) / total
        spread, product = (least / MAX_DRIFT) ** 2, 0.0
        for weight, (time, offset, _) in pairs:
            spread += weight * (time - centre) ** 2
            product += weight * (time - centre) * (offset - level)
        self._centre, self._level, self._slope = centre, level, product / spread
