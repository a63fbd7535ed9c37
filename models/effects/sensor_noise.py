"""A reading is noisier than the plan believes.

    reading = value + n + n',    n' white and normal with an rms beside the plan's n

Not to be confused with `link.jitter`, which scatters what is used, not what was read.
"""

from __future__ import annotations

from functools import partial

from models.effects.effect import Effect, Parameter
from models.effects.readings import SIGNALS, falsified, sized
from models.system import System


def apply(system: System, *, signal: str, rms: float) -> System:
    """White noise of `rms` added to the reading of `signal`."""
    return falsified(system, signal, noise=rms)


def effect(signal: str, unit: str) -> Effect:
    """The effect on one reading, `unit` its unit."""
    size = SIGNALS[signal]
    return Effect(
        name=f"sensor.{signal}.noise",
        site=f"sensor.{signal}",
        kind="measurement",
        says="the reading is noisier than believed",
        parameters=(
            Parameter(
                "rms",
                unit,
                null=0.0,
                least=0.0,
                most=size.typical,
                sizes=sized(size.noise, 0.7, 2.0, 6.0, 20.0),
                says="beside the plan's noise",
            ),
        ),
        reference="reading = value + white noise",
        apply=partial(apply, signal=signal),
    )
