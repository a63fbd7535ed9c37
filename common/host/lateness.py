"""Detects when so many ticks come late that a test cannot be called real-time."""

from __future__ import annotations

from collections import deque

# What pre-flight asks of a link that serves a rig (`exchanges`, `late_share` in [preflight]): a test in which more is
# late would not have been let begin. A single pause of 50 ms makes 25 ticks of 2 ms late and is not told.
WINDOW = 1000  # ticks
MOST = 50  # late ones among them
CALM = 5 * WINDOW  # ticks without that, before the next episode is told: at 2 ms every 10 s at most


class LateTicks:
    """Counts late ticks over a sliding window; an episode is told once, as it begins."""

    def __init__(self) -> None:
        self._late: deque[int] = deque()  # late ticks of the window
        self._told = -CALM  # newest tick of the episode, while there is one

    def take(self, tick: int, *, late: bool) -> int:
        """Take note of the next tick; how many of the window were late where an episode begins, else 0."""
        if late:
            self._late.append(tick)
        while self._late and self._late[0] <= tick - WINDOW:
            self._late.popleft()
        if len(self._late) <= MOST:
            return 0
        begins = tick - self._told >= CALM
        self._told = tick
        return len(self._late) if begins else 0


def sentence(late: int) -> str:
    """An episode that begins, in words."""
    return (
        f"{late} of the last {WINDOW} ticks came late, more than the {MOST} that pre-flight would let pass: the "
        "laboratories do not keep real time, and the recording contains the delays of this machine (`rths doctor`)."
    )
