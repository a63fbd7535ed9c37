"""Detects when too many ticks are late for a test in real time."""

from __future__ import annotations

from collections import deque

# These are the figures that pre-flight asks of a link (`exchanges` and `late_share` in [preflight]): a link with a
# larger share of late exchanges is refused. A single pause of 50 ms makes 25 ticks of 2 ms late and is not reported.
WINDOW = 1000  # ticks
MOST = 50  # late ticks among them
CALM = 5 * WINDOW  # ticks without an episode before the next is reported: at 2 ms at most one report in 10 s


class LateTicks:
    """Counts late ticks over a sliding window; an episode is reported once, when it begins."""

    def __init__(self) -> None:
        self._late: deque[int] = deque()  # late ticks of the window
        self._newest = -CALM  # newest tick of the last episode

    def take(self, tick: int, *, late: bool) -> int:
        """Count the next tick; return how many ticks of the window were late if an episode begins with it, else 0."""
        if late:
            self._late.append(tick)
        while self._late and self._late[0] <= tick - WINDOW:
            self._late.popleft()
        if len(self._late) <= MOST:
            return 0
        begins = tick - self._newest >= CALM
        self._newest = tick
        return len(self._late) if begins else 0


def sentence(late: int) -> str:
    """The sentence that reports an episode with this many late ticks."""
    return (
        f"{late} of the last {WINDOW} ticks came late, more than the {MOST} that pre-flight would let pass: the "
        "laboratories do not keep real time, and the recording contains the delays of this machine (`rths doctor`)."
    )
