"""A reading comes late: the filter of its amplifier.

    time_constant·ẏ + y = value,    reading = y

Not to be confused with a delay of what is measured: physics behind the sensor that other readings show is
on time here. A lagging column force looks like a negative `column.viscous`.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.reading import ReadingFault

LONGEST = 0.04  # s, of an amplifier or a filter against aliasing, whose corner is above 4 Hz; a longer one is a travel

FAULT = ReadingFault(
    "lag",
    lambda _: Parameter(
        "time_constant",
        "s",
        null=0.0,
        least=0.0,
        most=1.0,
        sizes=(0.001, 0.003, 0.008, 0.02),
        says="of a first-order low-pass",
        believed=LONGEST,
    ),
    says="the reading lags behind",
    reference="time_constant·ẏ + y = value",
)
