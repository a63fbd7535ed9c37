"""Statistics of the exchange with a rig in another process."""

from __future__ import annotations

import math
from array import array
from collections import Counter
from collections.abc import Sequence

LATE, MISSED, OLD, DAMAGED, FOREIGN = "late", "missed", "old", "damaged", "foreign"
CAUSES = {
    LATE: "for an earlier tick",
    MISSED: "missing when due",
    OLD: "old or doubled",
    DAMAGED: "damaged",
    FOREIGN: "of another test",
}


def quantile(ranked: Sequence[float], part: float) -> float:
    """The smallest of sorted values that has a share of `part` (0 to 1) of them at or below it; 0 without values."""
    return ranked[math.ceil(part * len(ranked)) - 1] if ranked else 0.0


class Account:
    """Counts of the answers by outcome, and the times that ticks waited for them."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._waited = array("q")  # ns

    def answered(self, waited_ns: int) -> None:
        """Count an answer in time, for which its tick waited `waited_ns`."""
        self._waited.append(waited_ns)

    @property
    def answers(self) -> int:
        """Number of answers in time."""
        return len(self._waited)

    def values(self) -> dict[str, float]:
        """The statistics, times in s; empty before the first answer or fault."""
        if not self._waited and not self.counts:
            return {}
        ranked = sorted(self._waited)
        found = {"answers": float(self.answers)} | {name: float(self.counts[name]) for name in CAUSES}
        parts = {"waited_p50": 0.5, "waited_p99": 0.99, "waited_max": 1.0}
        return found | {name: quantile(ranked, part) * 1e-9 for name, part in parts.items()}

    def sentence(self) -> str:
        """The statistics as a sentence."""
        values = self.values()
        faults = [f"{self.counts[name]} {text}" for name, text in CAUSES.items() if self.counts[name]]
        times = ", ".join(f"{name} {values[f'waited_{name}'] * 1e3:.3f} ms" for name in ("p50", "p99", "max"))
        return f"{self.answers} answers in time, {', '.join(faults) or 'none missing'}; a tick waited {times}"
