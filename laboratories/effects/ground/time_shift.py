"""The ground motion starts earlier or later than planned.

    z̈_true(t) = z̈(t − shift)

A positive shift is a later motion. Not to be confused with a delay inside the loop: the shift moves all signals in time
equally, and does not reduce the damping.
"""

from __future__ import annotations

from dataclasses import replace

from laboratories.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, shift: float) -> System:
    """Ground motion that comes `shift` s later."""
    return replace(system, effects=replace(system.effects, time_shift=shift))


EFFECT = Effect(
    name="ground.time_shift",
    site="ground",
    kind="physics",
    says="the ground motion comes earlier or later than planned",
    parameters=(
        Parameter(
            "shift",
            "s",
            null=0.0,
            least=-5.0,
            most=5.0,
            sizes=(-0.05, -0.01, -0.003, 0.003, 0.01, 0.05),
            says="positive: later",
        ),
    ),
    reference="z̈_true(t) = z̈(t − shift)",
    apply=apply,
    shifts_time=True,
)
