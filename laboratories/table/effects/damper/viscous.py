"""The damper's dashpot is stronger or weaker than planned.

    m·(s̈ + ÿ) = −k·s − factor·c·ṡ + u

Nothing changes where the plan has c = 0. Not to be confused with `damper.friction`: with a dashpot a free oscillation
decays exponentially, with friction linearly.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on, of_plan

EFFECT = factor_on(
    "damper",
    "viscous",
    of_plan("damper", "damping"),
    says="the damper's dashpot is stronger or weaker",
    reference="c_true = factor·c",
    bounds=(0.0, 50.0),
    sizes=(0.4, 0.7, 0.9, 1.15, 1.6, 2.5),
)
