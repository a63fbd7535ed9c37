"""Resonance of the table's oil column: the platform swings on top of the servo loop's motion.

    Y(s) = ω_o²/(s² + 2ζ_o·ω_o·s + ω_o²)·Y_loop(s),    ω_o = 2π·frequency, ζ_o = damping

Not to be confused with `table.bandwidth`: the resonance raises amplitudes near its own frequency.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Effect, Parameter
from models.system import System, TableEffects


def apply(system: System, frequency: float, damping: float) -> System:
    """Oil column at `frequency` Hz with `damping` ratio; without it the shape leaves no trace."""
    if math.isinf(frequency):
        damping = TableEffects.oil_damping
    return system.laid("table", oil_frequency=frequency, oil_damping=damping)


EFFECT = Effect(
    name="table.oil_column",
    site="table",
    kind="physics",
    says="a resonance on top of the table's loop",
    parameters=(
        Parameter("frequency", "Hz", null=math.inf, least=1.0, most=500.0, sizes=(40.0, 25.0, 16.0, 10.0)),
        Parameter(
            "damping",
            "",
            null=0.1,
            least=0.005,
            most=1.0,
            sizes=(0.03, 0.1, 0.3),
            says="damping ratio",
            shape=True,
            default=0.1,
        ),
    ),
    reference="Merritt, Hydraulic Control Systems, Wiley 1967",
    apply=apply,
)
