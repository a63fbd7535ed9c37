"""The damper's dashpot is stronger in one direction than in the other.

    m·(s̈ + ÿ) = −k·s − c·ṡ·(1 + share·sgn ṡ) + u

Nothing changes where the plan has c = 0. Not to be confused with `damper.friction` by direction, whose force does not
grow with speed, or with `damper.offset`, which acts at rest too.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "damper",
    "asymmetry",
    {
        "asymmetry": Parameter(
            "share",
            "",
            null=0.0,
            least=-0.95,
            most=0.95,
            sizes=(-0.5, -0.2, -0.05, 0.05, 0.2, 0.5),
            says="of the dashpot, added in the positive direction and taken away in the other",
        ),
    },
    says="the dashpot is stronger in one direction",
    reference="Janot, Gautier, Brunot, Data set and reference models of EMPS, Nonlinear System Identification "
    "Benchmarks 2019",
)
