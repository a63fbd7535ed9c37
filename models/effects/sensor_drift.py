"""A reading goes astray steadily: thermal drift, charge leaking.

    reading = value + rate·t

Not to be confused with `sensor.<signal>.bias`, which is there from the beginning.
"""

from __future__ import annotations

from functools import partial

from models.effects.effect import Effect, Parameter
from models.effects.readings import SIGNALS, falsified, sized
from models.system import System


def apply(system: System, *, signal: str, rate: float) -> System:
    """Reading of `signal` off by `rate` more each second."""
    return falsified(system, signal, drift=rate)


def effect(signal: str, unit: str) -> Effect:
    """The effect on one reading, `unit` its unit."""
    size = SIGNALS[signal]
    return Effect(
        name=f"sensor.{signal}.drift",
        site=f"sensor.{signal}",
        kind="measurement",
        says="the reading goes astray steadily",
        parameters=(
            Parameter(
                "rate",
                f"{unit}/s",
                null=0.0,
                least=-0.5 * size.typical,
                most=0.5 * size.typical,
                sizes=sized(size.typical, -1e-3, 1e-4, 1e-3, 4e-3),
                says="offset per second",
            ),
        ),
        reference="reading = value + rate·t",
        apply=partial(apply, signal=signal),
    )
