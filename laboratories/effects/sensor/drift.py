"""The error of a reading grows steadily: thermal drift, leaking charge.

    reading = value + rate·t

Not to be confused with `sensor.<signal>.bias`, which is there from the beginning.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.reading import ReadingFault, sized

FAULT = ReadingFault(
    "drift",
    lambda signal: Parameter(
        "rate",
        f"{signal.unit}/s",
        null=0.0,
        least=-0.5 * signal.typical,
        most=0.5 * signal.typical,
        sizes=sized(signal.typical, -1e-3, 1e-4, 1e-3, 4e-3),
        says="offset per second",
    ),
    says="the error of the reading grows steadily",
    reference="reading = value + rate·t",
    motionless=True,
)
