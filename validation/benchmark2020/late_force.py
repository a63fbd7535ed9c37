"""A force that arrives late: what the tracking criteria and the indicator of the force path show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from common.terminal.telling import Tell, untold
from laboratories.column.kind import COLUMN
from loop.force_path import force_path
from models.indicators import ForcePath
from models.system import Effects, SensorEffects
from validation.benchmark2020.problem import EL_CENTRO, SETTINGS, with_compensator
from validation.benchmark2020.runs import CellResult, Stage, play

# S, from below the period of a loop to above a critical delay.
DELAYS = (0.0, 0.5e-3, 1e-3, 2e-3, 3e-3, 5e-3, 7e-3, 10e-3)
SETTING = "amb"  # an adaptive compensator that tracks well, so that the late force causes most of the error


class LateForceTest(NamedTuple):
    """A test whose measured force is late by `delay` s."""

    delay: float
    result: CellResult
    path: ForcePath | None  # None where the loop is unstable or the path cannot be estimated


def late_forces(stages: Sequence[Stage], tell: Tell = untold) -> list[LateForceTest]:
    """Every delay on the nominal plant of every stage under El Centro, with the adaptive compensator."""
    asked = [(on, delay) for on in stages if on.motion is EL_CENTRO for delay in DELAYS]
    found = []
    for place, (on, delay) in enumerate(asked):
        tell("late forces", place, len(asked))
        found.append(late_force(on, delay))
    return found


def late_force(on: Stage, delay: float) -> LateForceTest:
    """One test."""
    plan = with_compensator(on.plants[0], SETTINGS[SETTING])
    effects = Effects(sensors={"column_force": SensorEffects(delay=delay)})
    result, rollout = play(on, SETTING, plan, effects=effects)
    path = (
        force_path(plan, *(rollout.master[name] for name in COLUMN.channels.names)) if result.stable else None
    )
    return LateForceTest(delay, result, path)
