"""The damper's spring is stiffer or softer than planned.

    m·(s̈ + ÿ) = −factor·k·s − c·ṡ + u

With `law` 1 it gains or loses stiffness with its stroke: factor·k·s·(1 + stiffening·s²). Nothing changes where the plan
has k = 0. Not to be confused with `damper.mass`: both change the damper's period, but only the mass changes its stroke
at high frequency.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import factor_on, which_law
from models.system import System


def apply(system: System, factor: float, law: float = 0.0, stiffening: float = 0.0) -> System:
    """The spring times `factor`, and the stiffening (1/m²) of law 1."""
    system = system.scaled("damper", "stiffness", factor)
    return system.laid("damper", stiffening=stiffening) if law != 0.0 else system


EFFECT = factor_on(
    "damper",
    "stiffness",
    apply,
    says="the damper's spring is stiffer or softer",
    reference="k_true = factor·k; Duffing, Erzwungene Schwingungen bei veränderlicher Eigenfrequenz, 1918",
    bounds=(0.0, 20.0),
    sizes=(0.5, 0.75, 0.9, 1.1, 1.4, 2.0),
    further=(
        which_law(1.0, "0 linear, 1 cubic"),
        Parameter(
            "stiffening",
            "1/m²",
            null=0.0,
            least=-400.0,
            most=1e5,
            sizes=(-20.0, 20.0, 200.0),
            says="share of the stiffness gained with the square of the stroke under law 1",
            shape=True,
        ),
    ),
    laws=(Law("linear", {}), Law("cubic", {"stiffening": 1.0})),
)
