"""One check per limit of a budget.

A check is `ok`, `over`, in `doubt` (over, but the bare loop was late in as many ticks) or `short` (so few values lie
beyond the percentile that it is next to the maximum).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from report.budget.figures import Bare, ExchangeTicks, measured
from report.budget.limits import PERCENTILES, WAITS, Budget, LateLimits, MachineLimits

OK, OVER, DOUBT, SHORT = "ok", "over", "doubt", "short"
WAKE, SUM = "wake_lateness", "round_trip"
# Values that must lie beyond a percentile: with fewer it is close to the maximum, which a single pause determines.
LEAST_BEYOND = 5
EPSILON = 1e-9  # s, or values: rounding of computed percentiles and counts


@dataclass(frozen=True)
class BudgetCheck:
    """One limit and the value found, in s, as a share or in ticks; `bare` is the bare loop's value, None without one.

    `calm` says that a value over its limit was judged without the ticks in which the master did not run.
    """

    name: str
    unit: str
    value: float
    bare: float | None
    limit: float
    allowed: float
    verdict: str
    calm: bool = False


def checks_of(item: ExchangeTicks, budget: Budget, bare: Bare | None) -> Iterator[BudgetCheck]:
    """The checks of the master's ticks with one slave."""
    for segment, limits in budget.segments.items():
        if segment in item.segments:
            for name, limit in limits.items():
                yield percentile_check(item, segment, name, limit, bare, budget.machine)
    yield from late_checks(item, budget.late, bare, budget.machine)


def late_checks(
    item: ExchangeTicks, late: LateLimits, bare: Bare | None, machine: MachineLimits
) -> Iterator[BudgetCheck]:
    """The checks of late and missed ticks; what was not recorded is not judged.

    Two waits of half an interval make a tick late, one of an interval makes the master miss it.
    """
    if item.late is not None:
        own = bare.late_share + bare.share_beyond(bare.interval / 2.0) if bare else None
        yield from share_check(item.label("late share"), item.late, late.share, own, WAITS[SUM], machine)
    if item.missed is not None:
        own = bare.late_share if bare else None
        yield from share_check(item.label("missed share"), item.missed, late.missed_share, own, 1, machine)
    if item.late is not None and np.isfinite(late.longest_gap):
        gap, stall = longest_run(item.late), bare.longest_gap if bare else None
        allowed = late.longest_gap + (stall or 0)
        verdict = OVER if gap > allowed else OK
        yield BudgetCheck(item.label("longest gap"), "ticks", gap, stall, late.longest_gap, allowed, verdict)


def percentile_check(
    item: ExchangeTicks, segment: str, name: str, limit: float, bare: Bare | None, machine: MachineLimits
) -> BudgetCheck:
    """A percentile of one segment against its limit, with what the bare loop adds for its waits."""
    values = measured(item.segments[segment])
    value, admitted = float(np.percentile(values, PERCENTILES[name])), 1.0 - PERCENTILES[name] / 100.0
    own = bare.percentiles[name] if bare else None
    allowed = limit + min(WAITS[segment] * (own or 0.0), machine.lateness)
    verdict = OK
    if values.size * admitted < LEAST_BEYOND - EPSILON:
        verdict = SHORT
    elif value > allowed + EPSILON:
        verdict = DOUBT if bare and explained(item, segment, limit, allowed, admitted, bare) else OVER
    calm = bare is not None and segment != WAKE
    return BudgetCheck(item.label(f"{segment} {name}"), "s", value, own, limit, allowed, verdict, calm)


def explained(
    item: ExchangeTicks, segment: str, limit: float, allowed: float, admitted: float, bare: Bare
) -> bool:
    """Whether the machine may have caused enough of the ticks beyond the allowed value that the rest are admitted.

    A wait of the machine causes one where it is longer than the room between the segment's usual time and the allowed
    one; in the round trip two waits of half that room do so. Shares of independent causes add up, while percentiles do
    not. Messages to a process that does not run wait as well: ticks that passed meanwhile are judged by [late] only.
    """
    values, waits = item.segments[segment], WAITS[segment]
    need = max(float(np.nanmedian(values)) - waits * bare.percentiles["p50"], 0.0)
    noise = waits * bare.share_beyond((allowed - need) / (2.0 if segment == SUM else 1.0))
    if segment == WAKE:
        noise += bare.late_share
    else:
        values = values[item.calm(bare.interval)]
    values = measured(values)
    beyond = float(np.mean(values > allowed)) if values.size else 0.0
    return need <= limit and beyond - noise <= admitted


def share_check(
    label: str, flags: NDArray[np.bool_], limit: float, own: float | None, waits: int, machine: MachineLimits
) -> Iterator[BudgetCheck]:
    """A share of ticks against its limit, with the bare loop's own share per wait; no check where there is no limit."""
    if not np.isfinite(limit):
        return
    value, noise = float(np.mean(flags)), waits * (own or 0.0)
    allowed = limit + min(noise, machine.share)
    verdict = OK if value <= allowed else DOUBT if value <= limit + noise else OVER
    yield BudgetCheck(label, "share", value, own, limit, allowed, verdict)


def longest_run(flags: NDArray[np.bool_]) -> int:
    """Length of the longest run of true values."""
    return max((sum(1 for _ in run) for flag, run in groupby(flags.tolist()) if flag), default=0)
