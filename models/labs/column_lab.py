"""Laboratory A: a hydraulic actuator deforms the column specimen."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.plan import Actuator, Column
from models import specimens
from models.compiled import jit
from models.registry import Array
from models.transfer_systems import delay, first_order


class ColumnLab(NamedTuple):
    """Arrays of the laboratory, in the order `advance` takes them."""

    code: int  # of the specimen
    taps: Array  # of the delayed command
    rows: Array  # of the actuator's propagation
    specimen: Array  # of the specimen
    history: Array  # commands written, newest first
    memory: Array  # of the specimen
    state: Array  # (displacement m, force N)


def build(interval: float, actuator: Actuator, column: Column) -> ColumnLab:
    """Laboratory at rest with the nominal or true parameters given."""
    segments = delay.split(interval, actuator.delay)
    rows = first_order.propagators(actuator.gain, actuator.time_constant, segments.lengths)
    code, params, memory = specimens.pack(column.model, stiffness=column.stiffness, **column.parameters)
    return ColumnLab(code, segments.taps, rows, params, np.zeros(segments.memory), memory, np.zeros(2))


@jit
def advance(
    code: int,
    taps: Array,
    rows: Array,
    specimen: Array,
    history: Array,
    memory: Array,
    state: Array,
    command: float,
) -> tuple[float, float]:
    """Displacement (m) and force (N) one interval later, the command ramped to `command` (m) by then."""
    delay.remember(history, command)
    displacement = state[0]
    force = state[1]
    before = delay.delayed(history, taps, 0)
    for i in range(rows.shape[0]):
        after = delay.delayed(history, taps, i + 1)
        displacement = first_order.step(rows[i], displacement, before, after)
        force = specimens.step(code, specimen, memory, displacement)
        before = after
    state[0] = displacement
    state[1] = force
    return displacement, force
