"""A reading comes late: converters, a bus, buffers of the data acquisition.

    reading(t) = value(t − delay)

Not to be confused with a lag (`sensor.*.lag`), which loses amplitude as the frequency rises and looks the same below
it, nor with `actuator.delay`, where what is measured is late itself. A late column force is negative damping that no
comparison of displacements shows.
"""

from __future__ import annotations

from functools import partial

from models.effects.effect import Effect, Parameter
from models.effects.readings import falsified
from models.system import System


def apply(system: System, *, signal: str, delay: float) -> System:
    """Reading of `signal` late by `delay` s."""
    return falsified(system, signal, delay=delay)


def effect(signal: str, unit: str) -> Effect:
    """The effect on one reading, `unit` its unit."""
    return Effect(
        name=f"sensor.{signal}.delay",
        site=f"sensor.{signal}",
        kind="measurement",
        says="the reading comes late",
        parameters=(
            Parameter(
                "delay",
                "s",
                null=0.0,
                least=0.0,
                most=1.0,
                sizes=(0.001, 0.003, 0.008, 0.02),
                says="between the value and its reading",
            ),
        ),
        reference="reading(t) = value(t − delay)",
        apply=partial(apply, signal=signal),
    )
