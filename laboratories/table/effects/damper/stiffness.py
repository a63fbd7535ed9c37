"""The damper's spring is stiffer or softer than planned.

    m·(s̈ + ÿ) = −factor·k·s − c·ṡ + u

Nothing changes where the plan has k = 0. Not to be confused with `damper.mass`: both change the damper's period, but
only the mass changes its stroke at high frequency.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on, of_plan

EFFECT = factor_on(
    "damper",
    "stiffness",
    of_plan("damper", "stiffness"),
    says="the damper's spring is stiffer or softer",
    reference="k_true = factor·k",
    bounds=(0.0, 20.0),
    sizes=(0.5, 0.75, 0.9, 1.1, 1.4, 2.0),
)
