"""Mass of the fixture that moves between load cell and specimen.

    reading = f_column + mass·δ̈

Not to be confused with `column.stiffness`: in harmonic motion it takes mass·ω² from the stiffness, so that
only a second frequency tells them apart.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "column",
    "inertia",
    {
        "inertia": Parameter(
            "mass", "kg", null=0.0, least=0.0, most=20000.0, sizes=(50.0, 200.0, 600.0, 2000.0)
        ),
    },
    says="inertia of the moving fixture in the load cell's reading",
    reference="f = f_column + mass·δ̈",
    timed=True,
)
