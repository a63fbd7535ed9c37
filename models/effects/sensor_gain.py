"""A reading is too large or too small by a factor: calibration.

    reading = factor·value

Not to be confused with a change of what is measured: of the column's force, with `column.stiffness`; of a
displacement or a force behind a drive, with that drive's gain.
"""

from __future__ import annotations

from functools import partial

from models.effects.effect import Effect, Parameter
from models.effects.readings import falsified
from models.system import System


def apply(system: System, *, signal: str, factor: float) -> System:
    """Reading of `signal` multiplied by `factor`."""
    return falsified(system, signal, gain=factor)


def effect(signal: str, unit: str) -> Effect:
    """The effect on one reading, `unit` its unit."""
    return Effect(
        name=f"sensor.{signal}.gain",
        site=f"sensor.{signal}",
        kind="measurement",
        says="the reading is too large or too small by a factor",
        parameters=(
            Parameter(
                "factor", "", null=1.0, least=0.0, most=5.0, sizes=(0.85, 0.93, 0.97, 1.03, 1.07, 1.15)
            ),
        ),
        reference="reading = factor·value",
        apply=partial(apply, signal=signal),
    )
