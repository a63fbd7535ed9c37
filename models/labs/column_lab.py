"""Laboratory A: a hydraulic actuator deforms the column specimen.

The servo loop `T·ẏ = K·u(t−L) − y` may lose a band of its error (valve overlap) and is no faster than its
valve lets oil through; under load the piston yields by the oil's and the frame's compliance, and play in
the clevis lies between it and the specimen.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from common.tables import Actuator, Column
from models.compiled import jit
from models.labs import specimen
from models.labs.specimen import REACTION
from models.registry import Array
from models.system import ActuatorEffects, ColumnEffects
from models.transfer_systems import delay, first_order

SUBSTEP = 0.25e-3  # s, longest step where an effect is no matter of straight lines

SERVO, DISPLACEMENT, FORCE = range(3)  # places in `state`: before compliance and play m, specimen m, N
PRESENT, VELOCITY_LIMIT, BACKLASH, COMPLIANCE, DEADBAND, GAIN, STIFFNESS = range(7)  # places in `limits`


class ColumnLab(NamedTuple):
    """Arrays of the laboratory, in the order `advance` takes them."""

    taps: Array  # of the delayed command
    rows: Array  # of the actuator's propagation
    lengths: Array  # of the segments, s
    limits: Array  # effects on the actuator
    history: Array  # commands written, newest first
    state: Array
    code: int  # of the specimen; then its arrays
    params: Array
    memory: Array
    effects: Array
    yielding: Array
    yielded: Array
    cell: Array


def build(
    interval: float,
    actuator: Actuator,
    column: Column,
    actuator_effects: ActuatorEffects | None = None,
    column_effects: ColumnEffects | None = None,
) -> ColumnLab:
    """Laboratory at rest with the nominal or true parameters given, and what is laid over them."""
    more = actuator_effects or ActuatorEffects()
    present = more != ActuatorEffects()
    short = present or specimen.needs_substeps(column_effects)
    segments = delay.split(interval, actuator.delay, substeps(interval) if short else 1)
    rows = first_order.propagators(actuator.gain, actuator.time_constant, segments.lengths)
    limits = [float(present), more.velocity_limit, more.backlash, more.compliance, more.deadband]
    return ColumnLab(
        segments.taps,
        rows,
        segments.lengths,
        np.array([*limits, actuator.gain, column.stiffness]),
        np.zeros(segments.memory),
        np.zeros(3),
        *specimen.build(column, column_effects),
    )


def substeps(interval: float) -> int:
    """Steps of an interval where effects need short ones."""
    return max(1, math.ceil(interval / SUBSTEP - 1e-9))


@jit
def advance(
    taps: Array,
    rows: Array,
    lengths: Array,
    limits: Array,
    history: Array,
    state: Array,
    code: int,
    params: Array,
    memory: Array,
    effects: Array,
    yielding: Array,
    yielded: Array,
    cell: Array,
    command: float,
) -> tuple[float, float]:
    """Displacement (m) and force (N) one interval later, the command ramped to `command` (m) by then."""
    delay.remember(history, command)
    servo, displacement, force = state[SERVO], state[DISPLACEMENT], state[FORCE]
    before = delay.delayed(history, taps, 0)
    for i in range(rows.shape[0]):
        after = delay.delayed(history, taps, i + 1)
        ahead = first_order.step(rows[i], servo, before, after)
        if limits[PRESENT] != 0.0:
            servo += limited(limits, ahead - servo, 0.5 * (before + after), servo, lengths[i])
            displacement = loaded(limits, servo, displacement, cell[REACTION])
        else:
            servo = ahead
            displacement = ahead
        force = specimen.force(
            code, params, memory, effects, yielding, yielded, cell, displacement, lengths[i]
        )
        before = after
    state[SERVO] = servo
    state[DISPLACEMENT] = displacement
    state[FORCE] = force
    return displacement, force


@jit
def limited(limits: Array, way: float, command: float, servo: float, length: float) -> float:
    """Way of the piston (m) within a segment, from the `way` of a valve without overlap or end."""
    error = abs(limits[GAIN] * command - servo)
    half = 0.5 * limits[DEADBAND]
    if half > 0.0:
        way *= max(error - half, 0.0) / error if error > 0.0 else 0.0
    longest = limits[VELOCITY_LIMIT] * length
    return min(max(way, -longest), longest)


@jit
def loaded(limits: Array, servo: float, displacement: float, reaction: float) -> float:
    """Deformation (m) of the specimen where the piston yields by `c·f` and the clevis has play.

    The force of the new deformation is `reaction + k·Δδ` with the specimen's first stiffness, which solves
    a linear specimen at once and a yielding one to within one short step.
    """
    compliance, stiffness = limits[COMPLIANCE], limits[STIFFNESS]
    pushed = servo - compliance * (reaction - stiffness * displacement)
    wanted = pushed / (1.0 + compliance * stiffness)
    half = 0.5 * limits[BACKLASH] / (1.0 + compliance * stiffness)
    return min(max(displacement, wanted - half), wanted + half)
