"""The numerical columns are stiffer or softer than planned.

    k_true = factor · k, of every storey

Only the numerical columns change; the specimen keeps its own stiffness. Not to be confused with
`column.stiffness`, which is visible in the measured force at a given deformation, or with `structure.p_delta`, which
adds the same stiffness to every storey in place of a share.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on, of_plan

EFFECT = factor_on(
    "structure",
    "stiffness",
    of_plan("structure", "stiffness"),
    says="the numerical columns are stiffer or softer",
    reference="f(x) = factor·k·x",
    bounds=(0.2, 5.0),
    sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3),
)
