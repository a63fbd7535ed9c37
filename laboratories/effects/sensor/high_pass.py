"""A reading forgets slow changes: its amplifier is coupled to alternating current, or its sensor's charge leaks.

    time_constant·ẏ + y = time_constant·ẋ,    reading = y,    x = value

Piezoelectric load cells and accelerometers, and geophones, read so. Motion that is slow for the time constant is read
early and too small: not to be confused with `column.viscous`, whose force is early too, but grows with the frequency.

Source: G. Gautschi, Piezoelectric Sensorics (2002), ch. 11.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Parameter
from laboratories.effects.reading import ReadingFault

FAULT = ReadingFault(
    "high_pass",
    lambda _: Parameter(
        "time_constant",
        "s",
        null=math.inf,
        least=0.05,
        most=1000.0,
        # from amplifiers of charge to accelerometers with a corner of 0.5 Hz
        sizes=(30.0, 10.0, 3.0, 1.0, 0.3),
        says="in which a constant value is forgotten",
    ),
    says="the reading forgets slow changes",
    reference="time_constant·ẏ + y = time_constant·ẋ",
    timed=True,
    units=("N", "m/s²", "m/s"),
)
