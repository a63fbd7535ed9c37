"""Counts at the receiving end what happened to each message of one direction, by its number."""

from __future__ import annotations

from collections import Counter

NOT_SEEN, REJECTED, ADMITTED, USED = range(4)
AHEAD, REPEATED = "ahead", "repeated"  # reasons that point to another sender than that of the test: see Tally


class Tally:
    """Admits fresh messages and keeps the result for every number; `ticks` is the number of ticks of the test.

    A message is fresh if its number is higher than all before and if it was sent within `window` intervals of its
    arrival, by the receiver's clock; a message that an interrupted transport delivers late is not fresh, nor is a
    number far ahead. A number ahead is not stored, because its sender cannot have reached it yet. The transports
    deliver no message twice, so one of two frames with the same number comes from another sender.
    """

    def __init__(self, ticks: int, window: int) -> None:
        self._fates = bytearray(ticks)
        self._window = window
        self._newest = -1
        self.reasons: Counter[str] = Counter()

    def extend(self, ticks: int) -> None:
        """Take note that the test has at least this many ticks; it never gets shorter."""
        self._fates.extend(bytes(max(ticks - len(self._fates), 0)))

    def admit(self, seq: int, expected: int) -> bool:
        """Whether the message `seq` is fresh; `expected` is the tick in which it came. It is counted either way."""
        window, fates = self._window, self._fates
        if self._newest < seq < len(fates) and expected - window <= seq <= expected + window:
            self._newest = seq
            fates[seq] = ADMITTED
            return True
        reason = self._reason(seq, expected)
        self.reasons[reason] += 1
        if reason != AHEAD and self._fates[seq] == NOT_SEEN:
            self._fates[seq] = REJECTED
        return False

    def _reason(self, seq: int, expected: int) -> str:
        """Why a message is not fresh."""
        if not 0 <= seq < len(self._fates) or seq > expected + self._window:
            return AHEAD
        if seq <= self._newest:
            return "old" if self._fates[seq] == NOT_SEEN else REPEATED
        return "stale"

    def lose(self, seq: int) -> None:
        """Take note that a link plug-in has lost a message that was admitted."""
        self._fates[seq] = NOT_SEEN

    def use(self, seq: int) -> None:
        """Take note that a message is in force."""
        if 0 <= seq < len(self._fates):
            self._fates[seq] = USED

    @property
    def used(self) -> int:
        """The number of messages that were in force."""
        return self._fates.count(USED)

    @property
    def rejected(self) -> int:
        """The number of messages that came but were never in force: too late, or after a newer one."""
        return self._fates.count(REJECTED) + self._fates.count(ADMITTED)

    def values(self, prefix: str) -> dict[str, float]:
        """The counts of used and rejected messages, and those of rejections by reason; each name has a prefix."""
        counts = {"used": self.used, "rejected": self.rejected} | {
            f"turned_away.{reason}": count for reason, count in sorted(self.reasons.items())
        }
        return {f"{prefix}.{name}": float(count) for name, count in counts.items()}
