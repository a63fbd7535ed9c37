"""The actuator's servo loop is slower or faster than believed.

    factor·T·ẏ + y = K·u(t − L)

Nothing changes where the plan has T = 0. Not to be confused with `actuator.delay`: at low frequency both
are a delay; only the lag loses amplitude as the frequency rises.
"""

from __future__ import annotations

from models.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, factor: float) -> System:
    """Time constant multiplied by `factor`."""
    return system.scaled("actuator", "time_constant", factor)


EFFECT = Effect(
    name="actuator.time_constant",
    site="actuator",
    kind="physics",
    says="the servo loop is slower or faster",
    parameters=(
        Parameter("factor", "", null=1.0, least=0.1, most=10.0, sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3)),
    ),
    reference="factor·T·ẏ + y = K·u(t − L)",
    apply=apply,
)
