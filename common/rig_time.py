"""Measures how long the calls of a rig take, and by how much they alone delay its loop."""

from __future__ import annotations


class RigTime:
    """The times of one rig's calls, summed per interval of the loop that makes them; in ns."""

    def __init__(self, interval_ns: int) -> None:
        self._interval = interval_ns
        self.begin()

    def begin(self) -> None:
        """Start counting at the first tick, since earlier calls delay no tick."""
        self._behind = self._spent = 0
        self._longest: dict[str, int] = {}

    def tick(self) -> None:
        """Start an interval: the time by which the calls exceeded the last one is carried over, as in a queue."""
        self._behind, self._spent = self.behind, 0
        if not self._behind:
            self._longest = {}

    def took(self, call: str, duration: int) -> None:
        """Add the duration (ns) of a call."""
        self._spent += duration
        self._longest[call] = max(duration, self._longest.get(call, 0))

    @property
    def behind(self) -> int:
        """How late a loop that only makes these calls would be, ns."""
        return max(self._behind + self._spent - self._interval, 0)

    def sentence(self) -> str:
        """The slow calls and their durations since the loop was last on time.

        It follows the rig's name in a sentence.
        """
        longest = max(self._longest, key=self._longest.__getitem__)
        slow = [longest] if self._longest[longest] > self._interval else sorted(self._longest)
        took = sum(self._longest[call] for call in slow)
        calls = " and ".join(f"{call}()" for call in slow)
        return (
            f"{calls} took {took * 1e-6:.1f} ms of the interval's {self._interval * 1e-6:g} ms, so let a thread of "
            "the rig wait for the hardware, or lengthen interval in [test]"
        )
