"""The longest time that the laboratories of a plan take to come to rest, by the ramp of each one's kind."""

from __future__ import annotations

import math
from collections.abc import Mapping

from common.plan.patience import strict
from common.plan.plan import Plan
from common.plan.tables import Limits
from laboratories.kind import Kind
from laboratories.kinds import kinds_of

MARGIN_S = 1.0  # for missed intervals, which lengthen the ramp: two pauses of the machine of 0.5 s
# Factor from the displacement of a floor relative to the ground to that of a drift, since two floors may move in
# opposite directions, or of a floor in absolute terms, since the ground moves as well.
BETWEEN = 2.0


def resting(plan: Plan) -> float:
    """The longest ramp to rest of the plan's laboratories, with the time to settle, s.

    Raises:
        InputError: a class that the plan names cannot be loaded or is no kind.
    """
    longest = max(way(kind, plan.of(role)) for role, kind in kinds_of(plan).items())
    return longest + plan.safety.settle + MARGIN_S


def way(kind: Kind, plan: Plan) -> float:
    """Duration (s) of a kind's ramp from the largest command with the largest velocity; `plan` as its role sees it."""
    limits, channels = (kind.limits(strict(plan)), kind.limits(Plan())), kind.channels
    far, step = reach(kind, plan, limits), speed(kind, plan, limits) * plan.test.interval
    effort = [least(limits, channels.effort.name)] if channels.effort else []
    effort = [value if math.isfinite(value) else 0.0 for value in effort]
    return kind.ramp(plan, (far, *effort), (far - step, *effort)).left


def least(limits: tuple[Mapping[str, float], ...], *names: str) -> float:
    """The first finite limit of these names, in the plan and then among the defaults; inf where there is none."""
    values = (one.get(name, math.inf) for one in limits for name in names)
    return next(filter(math.isfinite, values), math.inf)


def reach(kind: Kind, plan: Plan, limits: tuple[Mapping[str, float], ...]) -> float:
    """The largest command, m; for a device without a limit on it the largest that the building's motion allows."""
    channels = kind.channels
    found = least(limits, channels.command.name, channels.target.name, channels.position)
    if math.isfinite(found):
        return found
    return BETWEEN * kind.coupling(plan).ratio * plan.limits.displacement


def speed(kind: Kind, plan: Plan, limits: tuple[Mapping[str, float], ...]) -> float:
    """The largest velocity of a command, m/s; for a device without a limit on it that of the building by default."""
    for one in limits:
        velocity = one.get(kind.limited.velocity, math.inf)
        found = min(velocity, one.get(kind.limited.step, math.inf) / plan.test.interval)
        if math.isfinite(found):
            return found
    return BETWEEN * kind.coupling(plan).ratio * Limits().velocity
