"""The building that another program computes, started for a plan and its ground motion."""

from __future__ import annotations

import math

from common.foreign import ForeignModel, timed
from common.lab.preflight import PreflightCheck
from common.plan.plan import Plan
from common.safety.risks import Risk
from common.udp.account import quantile
from laboratories.kind import Follows
from laboratories.kinds import kinds_of
from loop import assembly, substructure
from models.registry import Array

# Most steps and seconds for which a model is timed: enough for the strong part of an earthquake at 10 ms, and no longer
# than the compiler's warm-up before a test.
TIMED_STEPS, TIMED_S = 2000, 1.5
TYPICAL = 0.99  # share of the steps that must fit: the laboratories hold over a late one (docs: safety)
# The same where all laboratories are emulated: they may hold over late steps, and a busy machine delays some per cent
# of the steps of any model. A model that is too slow itself is late in most of its steps.
EMULATED = 0.9
FINE = 1e-4  # s, to which a recommended interval is rounded up


def started(plan: Plan, ground: Array) -> ForeignModel:
    """The plan's model, started with the ground acceleration (ticks + 1,) m/s².

    Raises:
        InputError: it cannot be the building, or a laboratory's storey or floor is not in it.
    """
    task = {
        "options": plan.structure.options,
        "interval": plan.test.interval,
        "ground": ground.tolist(),
        "stiffness": stiffnesses(plan),
    }
    return ForeignModel(plan.structure.model, plan.base, plan.storeys, task)


def stiffnesses(plan: Plan) -> list[float]:
    """The nominal stiffness (N/m) that the laboratories have against the drift of every storey."""
    found = [0.0] * plan.storeys
    for role, kind in kinds_of(plan).items():
        coupling = kind.coupling(plan.of(role))
        assembly.check_place(plan, role, coupling)
        if coupling.follows is Follows.DRIFT:
            found[coupling.place - 1] += coupling.stiffness
    return found


def checked(plan: Plan, *, paced: bool = True) -> list[PreflightCheck]:
    """The time that a step of the model takes, and in real time whether the interval can be held; empty without one.

    Raises:
        InputError, InterlockError: the model cannot be the building, or its program ended.
    """
    if not plan.foreign:
        return []
    model = started(plan, substructure.ground_rows(plan, substructure.motion(plan))[0])
    try:
        found = sorted(timed(model, stiffnesses(plan), TIMED_STEPS, TIMED_S))
    finally:
        model.close()
    return [judged(plan, model.name, found, paced=paced)]


def judged(plan: Plan, name: str, ranked: list[float], *, paced: bool) -> PreflightCheck:
    """The check from sorted durations (s) of steps."""
    typical, least = quantile(ranked, TYPICAL), quantile(ranked, TYPICAL) / plan.link.wait_share
    least = math.ceil(least / FINE) * FINE
    times = (
        f"{quantile(ranked, 0.5) * 1e3:.2f} ms, {TYPICAL:.0%} of {len(ranked)} at most {typical * 1e3:.2f} ms"
    )
    text = f"A step of the building '{name}' takes {times}: it holds intervals from {least * 1e3:.1f} ms on"
    if not paced or least <= plan.test.interval:
        return PreflightCheck(text)
    if plan.emulated and quantile(ranked, EMULATED) <= plan.link.wait_share * plan.test.interval:
        return PreflightCheck(f"{text}; the emulated laboratories hold over the steps that come later")
    return PreflightCheck(
        text,
        Risk(
            "building",
            f"a step of the building '{name}' takes {times}, which does not fit into {plan.link.wait_share:.0%} of "
            f"the interval of {plan.test.interval * 1e3:g} ms, so raise interval in [test] to {least * 1e3:.1f} ms or "
            "make the model smaller",
        ),
    )
