"""Critical delays of the force: by search for the delay at which vibration grows, and by characteristic equation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.plan.plan import Plan, ideal
from loop.closed_loop import simulate
from loop.nominal.partition import critical_delay_of
from models.registry import Array
from models.system import Effects, SensorEffects
from validation.benchmark2020.problem import CASES, EL_CENTRO, PartitionCase, planned

# M: no stable motion of a building comes near it, and a diverging loop passes it before it overflows.
DIVERGED = 1e6
# S of free vibration after one impulse of the ground: over 90 cycles of the slowest mode (3.2 Hz).
LENGTH = 30.0
STEPS = 16  # halvings of the bracket, which end at 0.2 µs: published delays have 10 µs
SURE, TOO_MUCH = 0.5, 1.5  # times the equation's delay: ends of the bracket; the two methods agree within 1 %


class Critical(NamedTuple):
    """The delay of the measured force at which a case loses its damping, s."""

    case: int
    searched: float
    equation: float


def critical_delays() -> list[Critical]:
    """All cases."""
    return [critical_delay(case) for case in CASES]


def critical_delay(case: PartitionCase) -> Critical:
    """A case's delay by bisection between decaying and growing vibration, and by the characteristic equation.

    The transfer system is ideal and the sensors are free of noise. A force held over a step acts half an interval
    late on average: this is added to the delay that the search finds.
    """
    plan = still(case)
    equation = critical_delay_of(plan)
    below, above = SURE * equation, TOO_MUCH * equation
    for _ in range(STEPS):
        middle = 0.5 * (below + above)
        if growing(plan, middle):
            above = middle
        else:
            below = middle
    return Critical(case.number, 0.5 * (below + above) + 0.5 * plan.test.interval, equation)


def still(case: PartitionCase) -> Plan:
    """The case with an ideal transfer system and no delay in the path of the force."""
    plan = ideal(planned(case, EL_CENTRO))  # it has no unit delay of the force either
    return plan.with_ticks(round(LENGTH / plan.test.interval))


def growing(plan: Plan, delay: float) -> bool:
    """Whether the free vibration with a delay (s) of the force is larger in its last fifth than in the one before."""
    ground = np.zeros((2, plan.ticks + 1))
    ground[0, 1] = 1.0
    effects = Effects(sensors={"column_force": SensorEffects(delay=delay)})
    rollout = simulate(plan, ground, effects=effects, slaves={}, farthest=DIVERGED)
    if not rollout.finite:
        return True
    fifth = plan.ticks // 5
    target = np.ascontiguousarray(rollout.master["column_target"])
    last, before = target[-fifth:], target[-2 * fifth : -fifth]
    return energy(last) > energy(before)


def energy(values: Array) -> float:
    """Sum of squares."""
    return float(values @ values)
