"""How long the calls of a rig take, and by how much they alone put its loop behind."""

from __future__ import annotations


class RigTime:
    """An account of one rig's calls, in intervals of the loop that makes them; all times in ns."""

    def __init__(self, interval_ns: int) -> None:
        self._interval = interval_ns
        self.begin()

    def begin(self) -> None:
        """The first tick: calls before it have delayed no tick."""
        self._behind = self._spent = 0
        self._longest: dict[str, int] = {}

    def tick(self) -> None:
        """An interval begins: what its calls took beyond the one before stays as a debt, as in a queue."""
        self._behind, self._spent = self.behind, 0
        if not self._behind:
            self._longest = {}

    def took(self, call: str, duration: int) -> None:
        """A call of the interval is over."""
        self._spent += duration
        self._longest[call] = max(duration, self._longest.get(call, 0))

    @property
    def behind(self) -> int:
        """How late a loop would be that does nothing but these calls."""
        return max(self._behind + self._spent - self._interval, 0)

    def sentence(self) -> str:
        """Which calls took how long since the loop was last on time, for a sentence that begins with the rig's name."""
        longest = max(self._longest, key=self._longest.__getitem__)
        slow = [longest] if self._longest[longest] > self._interval else sorted(self._longest)
        took = sum(self._longest[call] for call in slow)
        calls = " and ".join(f"{call}()" for call in slow)
        return (
            f"{calls} took {took * 1e-6:.1f} ms of the interval's {self._interval * 1e-6:g} ms, so let a thread of "
            "the rig's own wait for the hardware, or lengthen interval in [test]"
        )
