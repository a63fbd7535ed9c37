"""The table's loop is slower or faster than planned.

    Y(s) = e^(−L·s)·(factor·ω)²/(s² + 2ζ·factor·ω·s + (factor·ω)²)·U(s)

Nothing changes for an ideal table (ω infinite). Not to be confused with `table.delay`: at low frequency
both are a delay, here 2ζ/ω.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on, of_plan

EFFECT = factor_on(
    "table",
    "bandwidth",
    of_plan("table", "frequency"),
    says="the table's loop is slower or faster",
    reference="ω_true = factor·ω",
    bounds=(0.1, 10.0),
    sizes=(0.5, 0.7, 0.9, 1.1, 1.4, 2.0),
    meaning="on ω",
    of_loop=True,
)
