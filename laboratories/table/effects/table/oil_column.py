"""Resonance of the table's oil column: the platform vibrates relative to the servo loop's motion.

    Y(s) = ω_o²/(s² + 2ζ_o·ω_o·s + ω_o²)·Y_loop(s),    ω_o = 2π·frequency, ζ_o = damping

Not to be confused with `table.bandwidth`: the resonance raises amplitudes near its own frequency.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "table",
    "oil_column",
    {
        "oil_frequency": Parameter(
            "frequency", "Hz", null=math.inf, least=1.0, most=500.0, sizes=(40.0, 25.0, 16.0, 10.0)
        ),
        "oil_damping": Parameter(
            "damping",
            "",
            null=0.1,
            least=0.005,
            most=1.0,
            sizes=(0.03, 0.1, 0.3),
            says="damping ratio",
            shape=True,
        ),
    },
    says="a resonance on top of the table's loop",
    reference="Merritt, Hydraulic Control Systems, Wiley 1967",
)
