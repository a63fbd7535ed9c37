"""A reading is too large or too small by a factor: calibration.

    reading = factor·value

Not to be confused with a change of what is measured: of the column's force, with `column.stiffness`; of a
displacement or a force behind a drive, with that drive's gain.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.reading import ReadingFault

FAULT = ReadingFault(
    "gain",
    lambda _: Parameter(
        "factor", "", null=1.0, least=0.0, most=5.0, sizes=(0.85, 0.93, 0.97, 1.03, 1.07, 1.15)
    ),
    says="the reading is too large or too small by a factor",
    reference="reading = factor·value",
)
