"""The specimen is stiffer or softer than the static test said.

    f = factor·k·δ

Not to be confused with a wrong load cell (`sensor.column_force.gain`): for a linear specimen the two
cannot be told apart by these signals.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on, of_plan

EFFECT = factor_on(
    "column",
    "stiffness",
    of_plan("column", "stiffness"),
    says="the specimen is stiffer or softer",
    reference="f = factor·k·δ",
    bounds=(0.001, 100.0),
    sizes=(0.7, 0.85, 0.94, 1.06, 1.15, 1.3),
)
