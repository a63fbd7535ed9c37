"""The verdict on a recording, with the figures and the checks that it rests on."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from report.budget.checks import OK, OVER, BudgetCheck, longest_run
from report.budget.figures import ExchangeTicks, Figures, measured
from report.budget.limits import PERCENTILES, Budget

WITHIN, NOT_JUDGED = "within", "not_judged"


@dataclass(frozen=True)
class BudgetReport:
    """A recording judged; `plain()` is what `--json` writes."""

    status: str
    figures: Figures
    budget: Budget
    checks: list[BudgetCheck]
    doubts: list[str]
    warnings: list[str]

    @property
    def exit_code(self) -> int:
        """1 where the recording is over its budget."""
        return int(self.status == OVER)

    def plain(self) -> dict[str, Any]:
        """Plain values without NaN or inf; with several slaves, names are led by theirs."""
        found = self.figures
        bare = found.bare
        return {
            "status": self.status,
            "recording": found.recording,
            "budget": self.budget.plain(),
            "ticks": max(item.ticks for item in found.exchanges),
            "segments": {name: row for item in found.exchanges for name, row in percentiles(item).items()},
            "late": {
                item.label(key): value for item in found.exchanges for key, value in counts(item).items()
            },
            "bare_loop": bare.plain() if bare else None,
            "machine": {"stolen_share": found.stolen, "scheduler": found.schedulers, "doubts": self.doubts},
            "checks": [asdict(check) | {"ok": check.verdict == OK} for check in self.checks],
            "warnings": self.warnings,
        }


def percentiles(item: ExchangeTicks) -> dict[str, dict[str, float | int]]:
    """Percentiles, maximum (s) and count of every segment that was measured."""
    return {
        item.label(name): {key: float(np.percentile(values, rank)) for key, rank in PERCENTILES.items()}
        | {"max": float(values.max()), "n": int(values.size)}
        for name, values in ((name, measured(column)) for name, column in item.segments.items())
    }


def counts(item: ExchangeTicks) -> dict[str, float | int]:
    """Late and missed ticks, their shares, and the longest run of late ones; what was not recorded is left out."""
    found: dict[str, float | int] = {"ticks": item.ticks}
    if item.late is not None:
        found |= {
            "late": int(item.late.sum()),
            "share": float(item.late.mean()),
            "longest_gap": longest_run(item.late),
        }
    if item.missed is not None:
        found |= {"missed": int(item.missed.sum()), "missed_share": float(item.missed.mean())}
    return found
