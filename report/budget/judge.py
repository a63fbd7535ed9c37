"""Figures judged against a budget: its checks, and one status.

A check that is over makes the recording `over`; otherwise a check in doubt makes it `not_judged`; otherwise it is
`within`. On an unfit machine every check that the machine may have failed is in doubt. A slave without any row of
latency is over any budget on any machine, since no disturbance of a machine loses every row.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from common.errors import InputError
from report.budget.checks import DOUBT, LEAST_BEYOND, OVER, SHORT, BudgetCheck, checks_of
from report.budget.figures import ExchangeTicks, Figures
from report.budget.limits import Budget, MachineLimits
from report.budget.verdict import NOT_JUDGED, WITHIN, BudgetReport
from report.text.formats import percent


def judge(found: Figures, budget: Budget) -> BudgetReport:
    """Judge figures against a budget.

    Raises:
        InputError: the recording has no value of anything that the budget limits.
    """
    unfit = unfitness(found, budget.machine)
    doubts = unfit or unsteadiness(found, budget.machine)
    checks = [check for item in found.exchanges for check in checks_of(item, budget, found.bare)]
    if not checks:
        raise InputError(
            f"{found.recording} has no value of anything that the budget {budget.name} limits: "
            f"{', '.join(limited(budget))}."
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
    """The check on an unsteady machine, where only those of messages hold, or on an unfit one, where none does."""
    stands = check.verdict != OVER or (check.calm and not unfit)
    return check if stands else replace(check, verdict=DOUBT)


def silence(item: ExchangeTicks) -> BudgetCheck:
    """The check that a slave without any row of latency fails: it allows no tick without one."""
    ticks = float(item.ticks)
    return BudgetCheck(item.label("ticks without latency"), "ticks", ticks, None, 0.0, 0.0, OVER)


def limited(budget: Budget) -> list[str]:
    """Names of the segments and shares that the budget limits."""
    return [*budget.segments, *budget.plain()["late"]]


def unfitness(found: Figures, machine: MachineLimits) -> list[str]:
    """A sentence for each reason not to judge values over their limits; none where the machine is fit."""
    remarks = [
        f"The host took {percent(share, 1)} of the processors' time of the {lab}: "
        f"beyond {percent(machine.stolen_share, 1)} nothing over its limit is judged."
        for lab, share in found.stolen.items()
        if share > machine.stolen_share
    ]
    if late_share(found) > machine.unfit_share:
        remarks.append(
            f"The bare loop itself was late in {percent(late_share(found), 2)} of its ticks: "
            f"beyond {percent(machine.unfit_share, 2)} nothing over its limit is judged."
        )
    return remarks


def unsteadiness(found: Figures, machine: MachineLimits) -> list[str]:
    """A sentence if the bare loop was late too often for the master's wake-ups to be judged, else none."""
    if late_share(found) <= machine.standstill_share:
        return []
    return [
        f"The bare loop itself was late in {percent(late_share(found), 2)} of its ticks: beyond "
        f"{percent(machine.standstill_share, 2)} late ticks and wake_lateness over their limits are not judged."
    ]


def late_share(found: Figures) -> float:
    """Share of late ticks of the bare loop, 0 where none ran."""
    return found.bare.late_share if found.bare else 0.0


def remarks(found: Figures, budget: Budget, checks: list[BudgetCheck]) -> list[str]:
    """A sentence for each limit that was not judged, or judged with less data than the budget assumes."""
    remarks = []
    if gone := [name for item in found.exchanges if not item.silent for name in absent(item, budget)]:
        remarks.append(f"The recording has no value of {', '.join(gone)}: not judged.")
    if short := [check.name for check in checks if check.verdict == SHORT]:
        remarks.append(f"Too few ticks for {', '.join(short)}: fewer than {LEAST_BEYOND} values lie beyond.")
    if found.bare is None and any(check.verdict == OVER for check in checks):
        remarks.append(
            "No bare loop was recorded, so a slow machine cannot be distinguished from a slow test."
        )
    return remarks


def absent(item: ExchangeTicks, budget: Budget) -> list[str]:
    """Names of what the budget limits but no tick has a value for."""
    late = budget.late
    names = [name for name in budget.segments if name not in item.segments]
    if item.late is None and np.isfinite(min(late.share, late.longest_gap)):
        names.append("late ticks")
    if item.missed is None and np.isfinite(late.missed_share):
        names.append("missed ticks")
    return [item.label(name) for name in names]
