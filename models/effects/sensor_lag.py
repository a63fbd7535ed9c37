"""A reading comes late: the filter of its amplifier.

    time_constant·ẏ + y = value,    reading = y

Not to be confused with a delay of what is measured: physics behind the sensor that other readings show is
on time here. A lagging column force looks like a negative `column.viscous`.
"""

from __future__ import annotations

from functools import partial

from models.effects.effect import Effect, Parameter
from models.effects.readings import falsified
from models.system import System


def apply(system: System, *, signal: str, time_constant: float) -> System:
    """Reading of `signal` behind a low-pass of `time_constant` s."""
    return falsified(system, signal, lag=time_constant)


def effect(signal: str, unit: str) -> Effect:
    """The effect on one reading, `unit` its unit."""
    return Effect(
        name=f"sensor.{signal}.lag",
        site=f"sensor.{signal}",
        kind="measurement",
        says="the reading lags behind",
        parameters=(
            Parameter(
                "time_constant",
                "s",
                null=0.0,
                least=0.0,
                most=1.0,
                sizes=(0.001, 0.003, 0.008, 0.02),
                says="of a first-order low-pass",
            ),
        ),
        reference="time_constant·ẏ + y = value",
        apply=partial(apply, signal=signal),
    )
