"""The actuator's servo loop is slower or faster than planned.

    factor·T·ẏ + y = K·u(t − L)

Where the plan has no lag, the lag is `(factor − 1)·1 ms`, as if the planned one were 1 ms. Not to be confused with
`actuator.delay`: at low frequency both are a delay; only the lag reduces the amplitude at higher frequency.
"""

from __future__ import annotations

from common.plan.plan import Plan
from laboratories.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, factor: float) -> System:
    """Time constant multiplied by `factor`."""
    planned = system.plan.actuator.time_constant
    lag = planned + (factor - 1.0) * (planned or LEAST_LAG)
    return system if factor == 1.0 else system.moved("actuator", time_constant=max(lag, 0.0))


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
    timed=True,
)
