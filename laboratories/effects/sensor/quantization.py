"""A reading comes in steps: resolution of its converter.

    reading = step·round(value/step), noise included in the value

`step` is the whole step, the error at most half of it. Not to be confused with `sensor.<signal>.noise`:
the readings lie on a grid.
"""

from __future__ import annotations

from laboratories.effects.effect import Parameter
from laboratories.effects.reading import ReadingFault, sized

FAULT = ReadingFault(
    "quantization",
    lambda signal: Parameter(
        "step",
        signal.unit,
        null=0.0,
        least=0.0,
        most=signal.typical,
        sizes=sized(signal.noise, 3.0, 10.0, 30.0, 100.0),
        says="whole step",
    ),
    says="the reading comes in steps",
    reference="Widrow, Kollár, Quantization Noise, Cambridge University Press 2008",
    in_samples=True,
)
