"""The numerical floors are heavier or lighter than planned.

    M_true = factor · M, of every storey

Not to be confused with `structure.stiffness`: both change the period, but only the mass changes the response to the
ground motion and to the damper's force otherwise.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on, of_plan

EFFECT = factor_on(
    "structure",
    "mass",
    of_plan("structure", "mass"),
    says="the numerical floors are heavier or lighter",
    reference="M·ẍ + C·ẋ + f(x) = −M·z̈ with factor·M",
    bounds=(0.2, 5.0),
    sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3),
)
