"""A reading is off by a constant.

    reading = value + offset

Not to be confused with `sensor.<signal>.drift`, which begins at zero. In a reading that feeds the loop, the
loop moves too.
"""

from __future__ import annotations

from functools import partial

from models.effects.effect import Effect, Parameter
from models.effects.readings import SIGNALS, falsified, sized
from models.system import System


def apply(system: System, *, signal: str, offset: float) -> System:
    """Reading of `signal` off by `offset`."""
    return falsified(system, signal, bias=offset)


def effect(signal: str, unit: str) -> Effect:
    """The effect on one reading, `unit` its unit."""
    size = SIGNALS[signal]
    return Effect(
        name=f"sensor.{signal}.bias",
        site=f"sensor.{signal}",
        kind="measurement",
        says="the reading is off by a constant",
        parameters=(
            Parameter(
                "offset",
                unit,
                null=0.0,
                least=-5.0 * size.typical,
                most=5.0 * size.typical,
                sizes=sized(size.typical, -0.05, -0.01, 0.002, 0.01, 0.05),
            ),
        ),
        reference="reading = value + offset",
        apply=partial(apply, signal=signal),
    )
