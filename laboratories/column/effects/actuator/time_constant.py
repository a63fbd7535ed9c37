"""The actuator's servo loop is slower or faster than planned.

    T·ẏ + y = K·u(t − L),    T = factor·T_a

Where the plan has no lag, the lag is `(factor − 1)·1 ms`, as if the planned one were 1 ms. Where it has one,
the parameter `law` chooses another formula:

    1   a loop of second order, as late for slow commands: (T/2ζ)²·ÿ + T·ẏ + y = K·u(t − L),    ζ = damping

A valve that is slow beside the loop makes ζ larger than 1, a loop with much gain or a resonance of the oil smaller.
Not to be confused with `actuator.delay`: at low frequency both are a delay; only the lag takes amplitude away where
the frequency is higher.
"""

from __future__ import annotations

import math

from common.plan.plan import Plan
from laboratories.effects.effect import Effect, Law, Parameter
from laboratories.effects.laws import of_second_order, which_law
from models.system import System


def apply(system: System, factor: float, law: float = 0.0, damping: float = math.inf) -> System:
    """Time constant multiplied by `factor`, and the damping ratio of law 1."""
    planned = system.plan.actuator.time_constant
    lag = planned + (factor - 1.0) * (planned or LEAST_LAG)
    if factor == 1.0:
        return system
    system = system.moved("actuator", time_constant=max(lag, 0.0))
    second = law != 0.0 and planned > 0.0  # one beside no lag would be as good as a delay
    return system.laid("actuator", lag_damping=damping) if second else system


def starts(plan: Plan) -> tuple[float, ...]:
    """Factors that give lags of 5 and 25 ms where the plan has none, with which the usual sizes would stay near 0."""
    return () if plan.actuator.time_constant else (6.0, 26.0)


LEAST_LAG = 1e-3  # s: short for any hydraulic actuator, so that factors up to 100 reach lags up to 0.1 s

EFFECT = Effect(
    name="actuator.time_constant",
    site="actuator",
    kind="physics",
    says="the servo loop is slower or faster",
    parameters=(
        Parameter("factor", "", null=1.0, least=0.1, most=100.0, sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3)),
    ),
    reference="factor·T·ẏ + y = K·u(t − L)",
    apply=apply,
    actuators=("fopdt",),
    starts=starts,
    further=(which_law(1.0, "0 of first order, 1 of second order"), of_second_order()),
    laws=(Law("of first order", {}), Law("of second order", {"damping": 1.0})),
    timed=True,
)
