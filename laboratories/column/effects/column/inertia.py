"""Mass of the fixture that moves between load cell and specimen.

    reading = f_column + mass·δ̈

Not to be confused with `column.stiffness`: in harmonic motion it takes mass·ω² from the stiffness, so that
only a second frequency tells them apart.
"""

from __future__ import annotations

from laboratories.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, mass: float) -> System:
    """Moving fixture of `mass` kg."""
    return system.laid("column", inertia=mass)


EFFECT = Effect(
    name="column.inertia",
    site="column",
    kind="physics",
    says="inertia of the moving fixture in the load cell's reading",
    parameters=(
        Parameter("mass", "kg", null=0.0, least=0.0, most=20000.0, sizes=(50.0, 200.0, 600.0, 2000.0)),
    ),
    reference="f = f_column + mass·δ̈",
    apply=apply,
)
