"""The ground motion is stronger or weaker than planned.

    z̈_true(t) = factor · z̈(t)

Not to be confused with a changed structure: the scale multiplies all responses of a linear test, and changes neither
period nor damping.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on, of_plan

EFFECT = factor_on(
    "ground",
    "scale",
    of_plan("ground_motion", "scale"),
    says="the ground motion is stronger or weaker than planned",
    reference="z̈_true = factor·z̈",
    bounds=(0.0, 5.0),
    sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3),
)
