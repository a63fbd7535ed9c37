"""A reading is noisier than planned.

    reading = value + n + n',    n' white and normal, in addition to the plan's n

Not to be confused with `link.jitter`, which varies the age of the values used, not the readings.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.reading import ReadingFault, sized

FAULT = ReadingFault(
    "noise",
    lambda signal: Parameter(
        "rms",
        signal.unit,
        null=0.0,
        least=0.0,
        most=signal.typical,
        sizes=sized(signal.noise, 0.7, 2.0, 6.0, 20.0),
        says="in addition to the plan's noise",
    ),
    says="the reading is noisier than planned",
    reference="reading = value + white noise",
    in_samples=True,
    random=True,
)
