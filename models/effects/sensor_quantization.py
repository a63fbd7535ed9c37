"""A reading comes in steps: resolution of its converter.

    reading = step·round(value/step), noise included in the value

`step` is the whole step, the error at most half of it. Not to be confused with `sensor.<signal>.noise`:
the readings lie on a grid.
"""

from __future__ import annotations

from functools import partial

from models.effects.effect import Effect, Parameter
from models.effects.readings import SIGNALS, falsified, sized
from models.system import System


def apply(system: System, *, signal: str, step: float) -> System:
    """Reading of `signal` rounded to a `step`."""
    return falsified(system, signal, quantization=step)


def effect(signal: str, unit: str) -> Effect:
    """The effect on one reading, `unit` its unit."""
    size = SIGNALS[signal]
    return Effect(
        name=f"sensor.{signal}.quantization",
        site=f"sensor.{signal}",
        kind="measurement",
        says="the reading comes in steps",
        parameters=(
            Parameter(
                "step",
                unit,
                null=0.0,
                least=0.0,
                most=size.typical,
                sizes=sized(size.noise, 3.0, 10.0, 30.0, 100.0),
                says="whole step",
            ),
        ),
        reference="Widrow, Kollár, Quantization Noise, Cambridge University Press 2008",
        apply=partial(apply, signal=signal),
    )
