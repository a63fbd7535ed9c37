"""A reading does not exceed a level: the end of a load cell, an amplifier or a converter.

    reading = value/(1 + |value/limit|ⁿ)^(1/n),    n = sharpness

With a small sharpness the reading bends long before the level, with a large one it is clipped there. Not to be
confused with a column that softens (`column.hardening` with a negative share): there a force of the same deformation
is lower, here a reading of the same force. The two differ only where the specimen yields, or has a dashpot or a mass,
so that one force belongs to several deformations.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Parameter
from laboratories.effects.reading import ReadingFault, sized

SHARPNESS = Parameter(
    "sharpness",
    "",
    null=2.0,
    least=1.0,
    most=20.0,
    sizes=(1.5, 3.0, 8.0),
    says="how suddenly the reading bends at the limit",
    shape=True,
)

FAULT = ReadingFault(
    "saturation",
    lambda signal: Parameter(
        "limit",
        signal.unit,
        null=math.inf,
        least=sized(signal.typical, 0.01)[0],
        most=sized(signal.typical, 100.0)[0],
        sizes=sized(signal.typical, 4.0, 2.5, 1.6, 1.0),
        says="level that the reading does not exceed",
        bends_by=SHARPNESS.name,
    ),
    says="the reading saturates",
    reference="reading = value/(1 + |value/limit|ⁿ)^(1/n)",
    shapes={"saturation_sharpness": SHARPNESS},
)
