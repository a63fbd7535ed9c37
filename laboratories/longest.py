"""How long the laboratories of a plan take at most to come to rest, by the ramp of each one's kind."""

from __future__ import annotations

import math
from collections.abc import Mapping

from common.plan.patience import strict
from common.plan.plan import Plan
from common.plan.tables import Limits
from laboratories.kind import Kind
from laboratories.kinds import kinds_of

MARGIN_S = 1.0  # on the way itself, for intervals that are left out
BETWEEN = 2.0  # a drift is between two floors, and a floor moves on top of the ground


def resting(plan: Plan) -> float:
    """The longest ramp to rest of the plan's laboratories, with the time to settle, s.

    Raises:
        InputError: a class that the plan names cannot be loaded or is no kind.
    """
    longest = max(way(kind, plan.of(role)) for role, kind in kinds_of(plan).items())
    return longest + plan.safety.settle + MARGIN_S


def way(kind: Kind, plan: Plan) -> float:
    """The ramp of a kind from the largest command at the largest speed away from zero, s; `plan` as its role has it."""
    limits, channels = (kind.limits(strict(plan)), kind.limits(Plan())), kind.channels
    far, step = reach(kind, plan, limits), speed(kind, plan, limits) * plan.test.interval
    effort = [least(limits, channels.effort.name)] if channels.effort else []
    effort = [value if math.isfinite(value) else 0.0 for value in effort]
    return kind.ramp(plan, (far, *effort), (far - step, *effort)).left


def least(limits: tuple[Mapping[str, float], ...], *names: str) -> float:
    """The first finite limit of one of these names: of the plan, then of a plan that writes none; inf where none is."""
    values = (one.get(name, math.inf) for one in limits for name in names)
    return next(filter(math.isfinite, values), math.inf)


def reach(kind: Kind, plan: Plan, limits: tuple[Mapping[str, float], ...]) -> float:
    """How far from zero a command may be, m; of a device that limits no motion as far as the building may move it."""
    channels = kind.channels
    found = least(limits, channels.command.name, channels.target.name, channels.position)
    if math.isfinite(found):
        return found
    return BETWEEN * kind.coupling(plan).ratio * plan.limits.displacement


def speed(kind: Kind, plan: Plan, limits: tuple[Mapping[str, float], ...]) -> float:
    """How fast a command may move, m/s; of a device without a limit on it as fast as the building usually may."""
    for one in limits:
        velocity = one.get(kind.limited.velocity, math.inf)
        found = min(velocity, one.get(kind.limited.step, math.inf) / plan.test.interval)
        if math.isfinite(found):
            return found
    return BETWEEN * kind.coupling(plan).ratio * Limits().velocity
