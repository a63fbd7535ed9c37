"""Gravity on the drift (P-Δ effect): the weight above a drifting storey increases its drift.

    f = k·x + k_g·x,    k_g = −P/h

with weight P above a storey of height h; the same k_g acts in every storey. Not to be confused with
`structure.stiffness`: the two are equal for one linear storey, and differ for several or yielding ones.
"""

from __future__ import annotations

from dataclasses import replace

from laboratories.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, stiffness: float) -> System:
    """Geometric `stiffness` (N/m), negative, added to the elastic one of every storey."""
    return replace(system, effects=replace(system.effects, p_delta=stiffness))


EFFECT = Effect(
    name="structure.p_delta",
    site="structure",
    kind="physics",
    says="gravity reduces the stiffness of drifting storeys",
    parameters=(
        Parameter(
            "stiffness",
            "N/m",
            null=0.0,
            least=-10000000.0,
            most=0.0,
            sizes=(-150000.0, -500000.0, -1500000.0, -4000000.0),
            says="negative, −P/h",
        ),
    ),
    reference="k_g = −P/h; Wilson, Habibullah, Earthquake Spectra 3 (1987) 289-298",
    apply=apply,
)
