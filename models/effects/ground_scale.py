"""The motion that came is stronger or weaker than the one believed.

    z̈_true(t) = factor · z̈(t)

Not to be confused with a changed structure: the scale moves all responses of a linear test alike, and
changes neither period nor damping.
"""

from __future__ import annotations

from models.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, factor: float) -> System:
    """Ground motion multiplied by `factor`."""
    return system.scaled("ground_motion", "scale", factor)


EFFECT = Effect(
    name="ground.scale",
    site="ground",
    kind="physics",
    says="the motion is stronger or weaker than believed",
    parameters=(
        Parameter("factor", "", null=1.0, least=0.0, most=5.0, sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3)),
    ),
    reference="z̈_true = factor·z̈",
    apply=apply,
)
