"""What nominal models say against a test: too little margin of delay, too little room below the limits."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from common.plan import Plan
from common.preflight import Check, Risk
from common.tables import Limits
from models import limited, several_slaves, substructure
from models.closed_loop import signals, simulate
from models.registry import Array
from models.structures.partition import Partition, assess

MOST_TICKS = 1_000_000  # of the simulation, which is kept in memory
MOST_SLAVE_TICKS = 60_000  # of all slaves where there are several, which are stepped one by one: about 4 s
LIMITS: dict[str, Any] = {name: field.metadata["rule"] for name, field in Limits.__dataclass_fields__.items()}


def checks(plan: Plan) -> list[Check]:
    """Partition and peaks of a plan, for a gate; raises InputError where a model or parameter cannot be."""
    return [partition_check(plan, assess(plan)), peaks_check(plan)]


# -- partition ------------------------------------------------------------------------------------


def expected_delay(plan: Plan, found: Partition) -> float:
    """Delay (s) to expect in the column's path: the compensated actuator's, and one interval for a late tick."""
    return found.delay + plan.test.interval


def partition_check(plan: Plan, found: Partition) -> Check:
    """The partition's check, for a gate."""
    return Check(partition_text(plan, found), partition_risk(plan, found))


def partition_risk(plan: Plan, found: Partition) -> Risk | None:
    """The risk of a delay too near to what the partition bears; None where the plan's margin is kept."""
    expected, margin = expected_delay(plan, found), plan.preflight.delay_margin
    if expected <= 0.0 or found.critical_delay >= margin * expected:
        return None
    return Risk(
        "partition",
        f"the column's path is unstable beyond {found.critical_delay * 1e3:.1f} ms of delay and "
        f"{expected * 1e3:.1f} ms are to be expected, where a margin of {margin:g} is wanted, so compensate the "
        "actuator in [compensator], give the structure more mass or damping, or let the specimen stand for less "
        "of its stiffness",
    )


def partition_text(plan: Plan, found: Partition) -> str:
    """What the partition bears and what is to be expected, in words."""
    expected = expected_delay(plan, found)
    cost = f"{found.damping_points * 100.0:+.2f} points of damping lost at {found.frequency:.2f} Hz"
    if math.isinf(found.critical_delay):
        return f"partition stable at any delay, {cost}"
    ratio = f" (× {found.critical_delay / expected:.0f})" if expected > 0.0 else ""
    return f"partition critical {found.critical_delay * 1e3:.1f} ms, expected {expected * 1e3:.1f} ms{ratio}, {cost}"


# -- peaks ----------------------------------------------------------------------------------------


class Peaks(NamedTuple):
    """How near the simulated test comes to its limits."""

    share: float  # largest peak over its limit
    name: str  # of that quantity
    first: str  # quantity that first exceeds its share of the limit, empty where none does
    tick: int  # at which it does
    peak: float  # of that quantity, in its unit


def peaks_check(plan: Plan) -> Check:
    """The check of the simulated peaks, for a gate."""
    most = MOST_SLAVE_TICKS // len(plan.slaves) if plan.slaves else MOST_TICKS
    short = plan.with_ticks(min(plan.ticks, most))
    ground = substructure.ground_rows(short, substructure.motion(short))
    if plan.slaves:
        columns = several_slaves.simulate(short, ground, short.test.seed)
        finite = columns["actuator_command"].size == short.ticks
    else:
        rollout = simulate(short, ground, seed=short.test.seed)
        columns, finite = signals(short, rollout), rollout.finite
    if not columns["actuator_command"].size:
        return Check(
            "", Risk("peaks", "the simulated test has no finite command at all, so look at [structure]")
        )
    found = peaks(short, columns)
    return Check(peaks_text(plan, found, short.ticks), peaks_risk(plan, found, finite=finite))


def peaks(plan: Plan, columns: dict[str, Array]) -> Peaks:
    """Peaks of simulated signals over the plan's limits."""
    most = vars(plan.limits)
    shares = {name: values / most[name] for name, values in limited.magnitudes(plan, columns).items()}
    tops = {name: float(np.max(share)) for name, share in shares.items()}
    over = {
        name: int(np.argmax(~(share <= plan.preflight.peak_share)))
        for name, share in shares.items()
        if not tops[name] <= plan.preflight.peak_share
    }
    name = max(tops, key=lambda one: tops[one])
    first = min(over, key=lambda one: over[one], default="")
    return Peaks(tops[name], name, first, over.get(first, 0), tops[first] * most[first] if first else 0.0)


def peaks_risk(plan: Plan, found: Peaks, *, finite: bool = True) -> Risk | None:
    """The risk of a peak too near to its limit; None where all keep their distance and the loop stays `finite`."""
    if not found.first:
        return None if finite else Risk("peaks", "the simulated loop diverges, so look at [compensator]")
    unit = LIMITS[found.first].unit
    limit, share = getattr(plan.limits, found.first), plan.preflight.peak_share
    ends = "" if finite else ", and the loop diverges"
    return Risk(
        "peaks",
        f"the simulated {found.first} exceeds {share:.0%} of its limit of {limit:g} {unit} at "
        f"t = {found.tick * plan.test.interval:.3f} s and peaks at {found.peak:.4g} {unit}{ends}, so lower scale in "
        f"[ground_motion], look at [compensator], or raise {found.first} in [limits] where the laboratory allows it",
    )


def peaks_text(plan: Plan, found: Peaks, ticks: int) -> str:
    """How near the simulated test comes to its limits, in words."""
    part = f" in the first {ticks * plan.test.interval:g} s" if ticks < plan.ticks else ""
    return f"peaks ≤ {found.share:.0%} of their limits ({found.name}){part}"
