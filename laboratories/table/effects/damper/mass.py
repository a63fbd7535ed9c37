"""The damper's moving mass is heavier or lighter than planned.

    factor·m·(s̈ + ÿ) = −k·s − c·ṡ + u

Not to be confused with `damper.gain`: where inertia dominates, both are a factor on the stroke under the motor's force
alone, but the stroke under the table's motion does not depend on the mass.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on, of_plan

EFFECT = factor_on(
    "damper",
    "mass",
    of_plan("damper", "mass"),
    says="the damper's mass is heavier or lighter",
    reference="m_true = factor·m",
    bounds=(0.2, 5.0),
    sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3),
)
