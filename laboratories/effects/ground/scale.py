"""The motion that came is stronger or weaker than the one believed.

    z̈_true(t) = factor · z̈(t)

Not to be confused with a changed structure: the scale moves all responses of a linear test alike, and
changes neither period nor damping.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on, of_plan

EFFECT = factor_on(
    "ground",
    "scale",
    of_plan("ground_motion", "scale"),
    says="the motion is stronger or weaker than believed",
    reference="z̈_true = factor·z̈",
    bounds=(0.0, 5.0),
    sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3),
)
