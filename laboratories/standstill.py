"""How the laboratories of a plan come to a standstill in the middle of a test, and whether the motion allows it.

The criteria are figures of the plan as they hold with a rig. The ramp is so long that the fastest motion which the
limits let pass is brought to rest within `acceleration` and `jerk` of [safety], the figures of the ramp to rest. What a
laboratory goes on doing by itself when its transfer system stands still, as the mass of a damper does, must stay within
its limits, and the energy that this takes from the test within the limit `error_energy`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from common.plan.patience import strict
from common.plan.plan import Plan
from common.roles import title
from laboratories.kind import Follows, Kind, Moving
from laboratories.kinds import kinds_of

UNLIMITED = (
    "nothing limits the speed of a target, from which the ramp to standstill follows: give `velocity` in "
    "[limits]"
)
# Largest slope of the rate over the ramp, and largest curvature: those of 1 − 3u² + 2u³ at u = 1/2 and u = 0.
SLOPE, CURVATURE = 1.5, 6.0


def ramp_ticks(plan: Plan) -> int:
    """Ticks, an even number, in which the earthquake's time comes to standstill; 0 where no limit gives them."""
    plan = strict(plan)
    speeds = [fastest(kind, plan, role) for role, kind in kinds_of(plan).items()]
    if not all(map(math.isfinite, speeds)):
        return 0
    safety, speed = plan.safety, max(speeds, default=0.0)
    time = max(SLOPE * speed / safety.acceleration, math.sqrt(CURVATURE * speed / safety.jerk))
    return max(2 * math.ceil(0.5 * time / plan.test.interval), 2)


def fastest(kind: Kind, plan: Plan, role: str) -> float:
    """Speed (m/s) that the limits let the target of a role's laboratory have; inf where none limits it."""
    seen = plan.of(role)
    own, coupling = kind.limits(seen), kind.coupling(seen)
    found = [own.get(name, math.inf) for name in (kind.channels.rates[0], kind.limited.velocity)]
    if coupling.follows is Follows.DRIFT:
        floors = 1 if coupling.place == 1 else 2  # that move the storey's ends
        found.append(abs(coupling.ratio) * floors * plan.limits.velocity)
    return min(found)


class Judgement(NamedTuple):
    """What a hold of a motion would mean."""

    obstacle: str  # why the laboratories cannot be held, empty where they can
    taken: float  # energy of their own motions that the test lacks afterwards, J at the building's scale


def judged(plan: Plan, moving: Mapping[str, Moving], spare: float) -> Judgement:
    """Whether the laboratories of a plan can be held in their present motion; `moving` by role.

    `spare` is the energy (J) of errors that the plan allows at present.
    """
    plan, taken = strict(plan), 0.0
    for role, kind in kinds_of(plan).items():
        seen = plan.of(role)
        coasting, whose = kind.coasting(seen, moving[role]), f"{kind.says} of the {title(role)}"
        if coasting is None:
            return Judgement(
                f"the {whose} follows a floor, and its kind does not say how it comes to rest: give the class of the "
                "kind a method `coasting`",
                math.inf,
            )
        most = kind.limits(seen).get(coasting.channel, math.inf)
        taken += coasting.energy
        if not coasting.peak <= most:
            unit = next(one.unit for one in kind.channels.measured if one.name == coasting.channel)
            return Judgement(
                f"the {whose} moves too fast: {coasting.channel} would reach {coasting.peak:.3g} {unit} when its "
                f"transfer system stands still, and its limit is {most:g} {unit}; wait until the motion is slower",
                taken,
            )
    if taken <= spare:
        return Judgement("", taken)
    return Judgement(
        f"the motion is too fast: its laboratories would lose {taken:.3g} J that belong to the test, and "
        f"error_energy in [limits] allows {max(spare, 0.0):.3g} J; wait until the motion is slower",
        taken,
    )
