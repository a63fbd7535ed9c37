"""A reading comes late: the filter of its amplifier.

    time_constant·ẏ + y = value,    reading = y

Not to be confused with a delay of the measured quantity itself: here other readings of the same motion are on time. A
lagging column force looks like a negative `column.viscous`.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.reading import ReadingFault

# s: an amplifier or an anti-aliasing filter has a corner above 4 Hz; a longer lag belongs to the measured motion
LONGEST = 0.04

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
    timed=True,
)
