"""The table's loop is slower or faster than believed.

    Y(s) = e^(−L·s)·(factor·ω)²/(s² + 2ζ·factor·ω·s + (factor·ω)²)·U(s)

Nothing changes for an ideal table (ω infinite). Not to be confused with `table.delay`: at low frequency
both are a delay, here 2ζ/ω.
"""

from __future__ import annotations

from models.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, factor: float) -> System:
    """Natural frequency multiplied by `factor`."""
    return system.scaled("table", "frequency", factor)


EFFECT = Effect(
    name="table.bandwidth",
    site="table",
    kind="physics",
    says="the table's loop is slower or faster",
    parameters=(
        Parameter(
            "factor", "", null=1.0, least=0.1, most=10.0, sizes=(0.5, 0.7, 0.9, 1.1, 1.4, 2.0), says="on ω"
        ),
    ),
    reference="ω_true = factor·ω",
    apply=apply,
)
