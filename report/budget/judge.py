"""Figures judged against a budget: its checks, and one status.

A check that is over makes the recording `over`; else one in doubt leaves it `not_judged`; else it is `within`. On an
unfit machine what it may have caused is in doubt. A slave without a row of latency is over any budget on any machine:
its gap is the whole test, and no noise loses every row.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from common.errors import InputError
from report.budget.checks import DOUBT, LEAST_BEYOND, OK, OVER, SHORT, BudgetCheck, checks_of, longest_run
from report.budget.figures import ExchangeTicks, Figures, measured
from report.budget.limits import PERCENTILES, Budget, MachineLimits
from report.text.formats import percent

WITHIN, NOT_JUDGED = "within", "not_judged"


@dataclass(frozen=True)
class BudgetReport:
    """A recording judged; `str()` is the table, `plain()` what `--json` writes."""

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

    def __str__(self) -> str:
        from report.budget.text import text

        return text(self)

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


def judge(found: Figures, budget: Budget) -> BudgetReport:
    """Judge figures against a budget.

    Raises:
        InputError: the recording has nothing of what the budget limits.
    """
    unfit = unfitness(found, budget.machine)
    doubts = unfit or unsteadiness(found, budget.machine)
    checks = [check for item in found.exchanges for check in checks_of(item, budget, found.bare)]
    if not checks:
        raise InputError(
            f"{found.recording} has no value of what the budget {budget.name} limits: {', '.join(limited(budget))}."
        )
    if doubts:
        checks = [excused(check, unfit=bool(unfit)) for check in checks]
    checks += [silence(item) for item in found.exchanges if item.silent]
    verdicts = {check.verdict for check in checks}
    unknown = DOUBT in verdicts or verdicts == {SHORT}
    status = OVER if OVER in verdicts else NOT_JUDGED if unknown else WITHIN
    return BudgetReport(
        status, found, budget, checks, doubts, found.warnings + remarks(found, budget, checks)
    )


def excused(check: BudgetCheck, *, unfit: bool) -> BudgetCheck:
    """The check on an unsteady machine, where those of messages alone stand, or on an unfit one, where none does."""
    stands = check.verdict != OVER or (check.calm and not unfit)
    return check if stands else replace(check, verdict=DOUBT)


def silence(item: ExchangeTicks) -> BudgetCheck:
    """The check that a slave without a row of latency fails: no tick may be without where all are."""
    ticks = float(item.ticks)
    return BudgetCheck(item.label("ticks without latency"), "ticks", ticks, None, 0.0, 0.0, OVER)


def limited(budget: Budget) -> list[str]:
    """Names of what the budget limits."""
    return [*budget.segments, *budget.plain()["late"]]


def unfitness(found: Figures, machine: MachineLimits) -> list[str]:
    """Why nothing over its limit is judged, a sentence each; none where the machine is fit."""
    said = [
        f"The host took {percent(share, 1)} of the processors' time of the {lab}: "
        f"beyond {percent(machine.stolen_share, 1)} nothing over its limit is judged."
        for lab, share in found.stolen.items()
        if share > machine.stolen_share
    ]
    if late_share(found) > machine.unfit_share:
        said.append(
            f"The bare loop itself was late in {percent(late_share(found), 2)} of its ticks: "
            f"beyond {percent(machine.unfit_share, 2)} nothing over its limit is judged."
        )
    return said


def unsteadiness(found: Figures, machine: MachineLimits) -> list[str]:
    """A sentence if the bare loop was held up too often to judge the master's wake-ups, else none."""
    if late_share(found) <= machine.standstill_share:
        return []
    return [
        f"The bare loop itself was late in {percent(late_share(found), 2)} of its ticks: beyond "
        f"{percent(machine.standstill_share, 2)} late ticks and wake_lateness over their limits are not judged."
    ]


def late_share(found: Figures) -> float:
    """Share of late ticks of the bare loop, 0 where none ran."""
    return found.bare.late_share if found.bare else 0.0


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


def remarks(found: Figures, budget: Budget, checks: list[BudgetCheck]) -> list[str]:
    """What was not judged, or judged with less data than the budget assumes, a sentence each."""
    said = []
    if gone := [name for item in found.exchanges if not item.silent for name in absent(item, budget)]:
        said.append(f"The recording has no value of {', '.join(gone)}: not judged.")
    if short := [check.name for check in checks if check.verdict == SHORT]:
        said.append(f"Too few ticks for {', '.join(short)}: fewer than {LEAST_BEYOND} values lie beyond.")
    if found.bare is None and any(check.verdict == OVER for check in checks):
        said.append("No bare loop was recorded: a slow machine cannot be told from a slow test here.")
    return said


def absent(item: ExchangeTicks, budget: Budget) -> list[str]:
    """What the budget limits and no tick has a value of."""
    late = budget.late
    names = [name for name in budget.segments if name not in item.segments]
    if item.late is None and np.isfinite(min(late.share, late.longest_gap)):
        names.append("late ticks")
    if item.missed is None and np.isfinite(late.missed_share):
        names.append("missed ticks")
    return [item.label(name) for name in names]
