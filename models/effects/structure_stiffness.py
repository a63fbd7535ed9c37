"""The numerical columns are stiffer or softer than believed.

    k_true = factor · k, of every storey

Only the numerical columns change; the specimen keeps its own stiffness. Not to be confused with
`column.stiffness`, which shows in the measured force at a given deformation, or with `structure.p_delta`,
which adds the same stiffness to every storey instead of a share.
"""

from __future__ import annotations

from models.effects.effect import Effect, Parameter
from models.system import System


def apply(system: System, factor: float) -> System:
    """Storey stiffnesses, or the stiffness matrix, multiplied by `factor`."""
    return system.scaled("structure", "stiffness", factor)


EFFECT = Effect(
    name="structure.stiffness",
    site="structure",
    kind="physics",
    says="the numerical columns are stiffer or softer",
    parameters=(
        Parameter("factor", "", null=1.0, least=0.2, most=5.0, sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3)),
    ),
    reference="f(x) = factor·k·x",
    apply=apply,
)
