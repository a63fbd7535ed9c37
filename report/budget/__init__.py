"""Latency budgets: a recording judged against limits on percentiles, late ticks and gaps.

`report/budget/default.toml` says what is compared with what, and why.
"""

from __future__ import annotations

from pathlib import Path

from common.recording.reader import read
from report.budget.figures import figures
from report.budget.judge import judge
from report.budget.limits import load
from report.budget.text import text
from report.budget.verdict import BudgetReport

__all__ = ["BudgetReport", "assess", "text"]


def assess(recording: str | Path, budget: str | Path | None = None) -> BudgetReport:
    """The verdict on a recording, by the budget that ships where none is given.

    Raises:
        InputError: the recording or the budget cannot be read, or nothing in it can be judged.
    """
    limits = load(Path(budget) if budget is not None else None)
    return judge(figures(read(Path(recording))), limits)
