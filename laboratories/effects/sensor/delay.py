"""A reading comes late: converters, a bus, buffers of the data acquisition.

    reading(t) = value(t − delay)

Not to be confused with a lag (`sensor.*.lag`), which loses amplitude as the frequency rises and looks the same below
it, nor with `actuator.delay`, where what is measured is late itself. A late column force is negative damping that no
comparison of displacements shows.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.reading import ReadingFault

LONGEST = 0.1  # s, of converters, buses and buffers in a loop that is controlled; a longer one is a travel

FAULT = ReadingFault(
    "delay",
    lambda _: Parameter(
        "delay",
        "s",
        null=0.0,
        least=0.0,
        most=1.0,
        sizes=(0.001, 0.003, 0.008, 0.02),
        says="between the value and its reading",
        believed=LONGEST,
    ),
    says="the reading comes late",
    reference="reading(t) = value(t − delay)",
    timed=True,
)
