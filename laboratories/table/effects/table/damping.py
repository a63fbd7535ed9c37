"""The table's loop is damped more or less than planned.

    Y(s) = e^(−L·s)·ω²/(s² + 2·factor·ζ·ω·s + ω²)·U(s)

Nothing changes for an ideal table (ω infinite). Not to be confused with `table.bandwidth`, which moves ω, or with
`table.delay`: well below ω all three are a delay, here 2·factor·ζ/ω in total.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on, of_plan

EFFECT = factor_on(
    "table",
    "damping",
    of_plan("table", "damping_ratio"),
    says="the table's loop is damped more or less",
    reference="ζ_true = factor·ζ",
    bounds=(0.05, 20.0),
    sizes=(0.5, 0.75, 0.9, 1.15, 1.5, 2.5),
    meaning="on ζ",
    of_loop=True,
)
