"""Dead time of the shaking table beyond the plan's.

    Y(s) = e^(−(L + delay)·s)·ω²/(s² + 2ζω·s + ω²)·U(s)

The total is at least 0. Not to be confused with `table.bandwidth`, which delays slow motion in the same way but changes
amplitudes near ω, or with `link.delay`, which is visible in the messages' time stamps.
"""

from __future__ import annotations

from laboratories.effects.laws import adds, extra_time

EFFECT = adds(
    "table",
    "delay",
    "delay",
    extra_time("delay", (-0.003, -0.001, 0.001, 0.003, 0.008, 0.02)),
    says="dead time of the table is longer or shorter",
    reference="Y(s) = e^(−(L + delay)·s)·ω²/(s² + 2ζω·s + ω²)·U(s)",
    of_loop=True,
)
