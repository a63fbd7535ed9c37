"""Rejected frames: counted by reason, and reported while the test runs."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Mapping
from typing import Any, NamedTuple

from common.protocol.codec import Reject

# between two reports: a second, so that a user can read them however many frames a stranger sends
NEWS_NS = 1_000_000_000
UNTOLD = frozenset(
    {Reject.UNREGISTERED.value}
)  # not reported: a process in no test receives frames of other tests


class RejectionCount(NamedTuple):
    """The rejections for one reason: when they began (ns), and which role the sender of the last one claimed."""

    first_ns: int
    role: str


class Rejections:
    """Counts rejected frames; `add` may be called from any thread, `news` from one."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.seen: dict[str, RejectionCount] = {}
        self._lock = threading.Lock()
        self._told: dict[str, int] = {}
        self._told_ns = -NEWS_NS
        self._fresh = False

    def add(self, reason: Reject, role: str, now_ns: int) -> None:
        """Count one rejected frame, whose sender claims this role."""
        name = reason.value
        with self._lock:
            first_ns = self.seen[name].first_ns if name in self.seen else now_ns
            self.seen[name] = RejectionCount(first_ns, role)
            self.counts[name] += 1  # after `seen`, which `news` reads for every reason that has a count
        self._fresh = self._fresh or name not in UNTOLD

    def news(self, now_ns: int) -> dict[str, Any] | None:
        """An event on the frames rejected since the last one, at most one a second; None where there is nothing new.

        It holds `code`, `level` and `text` of the event, and as `values` the counts of the whole test by reason.
        """
        if not self._fresh or now_ns - self._told_ns < NEWS_NS:
            return None
        self._fresh = False
        self._told_ns = now_ns
        counts = told(self.counts)
        fresh = {name: count - self._told.get(name, 0) for name, count in counts.items()}
        self._told = counts
        new = ", ".join(
            f"{count} by {name} (last from the {self.seen[name].role})"
            for name, count in fresh.items()
            if count
        )
        return {
            "code": "rejected",
            "level": "warning",
            "text": f"Frames were rejected: {new}.",
            "values": {name: float(count) for name, count in counts.items()},
        }


def told(counts: Mapping[str, int]) -> dict[str, int]:
    """The counts that the events of a test report, by reason."""
    return {name: count for name, count in sorted(counts.items()) if name not in UNTOLD}
