"""A reading is off by a constant.

    reading = value + offset

Not to be confused with `sensor.<signal>.drift`, which begins at zero. In a reading that feeds the loop, the
loop moves too.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.reading import ReadingFault, sized

FAULT = ReadingFault(
    "bias",
    lambda signal: Parameter(
        "offset",
        signal.unit,
        null=0.0,
        least=-5.0 * signal.typical,
        most=5.0 * signal.typical,
        sizes=sized(signal.typical, -0.05, -0.01, 0.002, 0.01, 0.05),
    ),
    says="the reading is off by a constant",
    reference="reading = value + offset",
    motionless=True,
)
