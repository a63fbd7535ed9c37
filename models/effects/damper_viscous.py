"""The damper's dashpot is stronger or weaker than believed.

    m·(s̈ + ÿ) = −k·s − factor·c·ṡ + u

Nothing changes where the plan has c = 0. Not to be confused with `damper.friction`: the decay of a free
oscillation is exponential here, straight there.
"""

from __future__ import annotations

from models.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, factor: float) -> System:
    """Dashpot multiplied by `factor`."""
    return system.scaled("damper", "damping", factor)


EFFECT = Effect(
    name="damper.viscous",
    site="damper",
    kind="physics",
    says="the damper's dashpot is stronger or weaker",
    parameters=(
        Parameter("factor", "", null=1.0, least=0.0, most=50.0, sizes=(0.4, 0.7, 0.9, 1.15, 1.6, 2.5)),
    ),
    reference="c_true = factor·c",
    apply=apply,
)
