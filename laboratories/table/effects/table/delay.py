"""Dead time of the shaking table beyond the plan's.

    Y(s) = e^(−(L + delay)·s)·ω²/(s² + 2ζω·s + ω²)·U(s)

The total is at least 0. Not to be confused with `table.bandwidth`, which delays slow motion alike but
changes amplitudes near ω, or with `link.delay`, which the messages' stamps show.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import adds

EFFECT = adds(
    "table",
    "delay",
    "delay",
    Parameter(
        "delay",
        "s",
        null=0.0,
        least=-0.05,
        most=0.2,
        sizes=(-0.003, -0.001, 0.001, 0.003, 0.008, 0.02),
        says="added",
    ),
    says="dead time of the table is longer or shorter",
    reference="Y(s) = e^(−(L + delay)·s)·ω²/(s² + 2ζω·s + ω²)·U(s)",
)
