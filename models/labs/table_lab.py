"""Laboratory B: a shaking table carries the active mass damper.

Table `Y = e^(−Ls)·ω²/(s² + 2ζωs + ω²)·U`; damper `m·(s̈ + ÿ) = −k·s − c·ṡ + u`, motor `T·u̇ + u = F`;
force on the table `k·s + c·ṡ − u`. All of it is linear, so one matrix carries table, damper and motor
over each segment without error, for a table command that is a straight line and a motor command that
is held.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from common.plan import Damper, Table
from models.compiled import jit
from models.registry import Array
from models.transfer_systems import delay

TABLE, TABLE_RATE, STROKE, STROKE_RATE, MOTOR, ACCELERATION = range(6)
MOTION = 5  # states that move; the table's acceleration follows from them and is kept beside
STATES = 6
COMMAND_BEFORE, COMMAND_AFTER, MOTOR_COMMAND = 6, 7, 8
WIDTH = 9


class TableLab(NamedTuple):
    """Arrays of the laboratory, in the order `advance` takes them."""

    taps: Array  # of the delayed command
    matrices: Array  # (m, 6, 9): next state from state, command before and after, motor command
    spring: Array  # (stiffness N/m, dashpot N·s/m) of the damper
    history: Array  # table commands written, newest first
    state: Array  # (6,)
    scratch: Array  # (9,)


def build(interval: float, table: Table, damper: Damper) -> TableLab:
    """Laboratory at rest with the nominal or true parameters given."""
    segments = delay.split(interval, table.delay)
    propagate = ideal_matrix if math.isinf(table.frequency) else lagging_matrix
    matrices = np.stack([propagate(float(length), table, damper) for length in segments.lengths])
    spring = np.array([damper.stiffness, damper.damping])
    return TableLab(
        segments.taps, matrices, spring, np.zeros(segments.memory), np.zeros(STATES), np.zeros(WIDTH)
    )


@jit
def advance(
    taps: Array,
    matrices: Array,
    spring: Array,
    history: Array,
    state: Array,
    scratch: Array,
    command: float,
    motor_command: float,
) -> tuple[float, float, float, float]:
    """Table displacement (m) and acceleration (m/s²), stroke (m) and force (N) one interval later.

    The table's command is ramped to `command` (m) by then, the motor's (N) is held.
    """
    delay.remember(history, command)
    scratch[MOTOR_COMMAND] = motor_command
    scratch[COMMAND_AFTER] = delay.delayed(history, taps, 0)
    for i in range(matrices.shape[0]):
        for row in range(STATES):
            scratch[row] = state[row]
        scratch[COMMAND_BEFORE] = scratch[COMMAND_AFTER]
        scratch[COMMAND_AFTER] = delay.delayed(history, taps, i + 1)
        for row in range(STATES):
            value = 0.0
            for column in range(WIDTH):
                value += matrices[i, row, column] * scratch[column]
            state[row] = value
    force = spring[0] * state[STROKE] + spring[1] * state[STROKE_RATE] - state[MOTOR]
    return state[TABLE], state[ACCELERATION], state[STROKE], force


def damper_rows(a: Array, b: Array, damper: Damper) -> None:
    """Fill the damper's and the motor's rows of the rate matrices, the table's acceleration left out."""
    a[STROKE, STROKE_RATE] = 1.0
    a[STROKE_RATE, STROKE] = -damper.stiffness / damper.mass
    a[STROKE_RATE, STROKE_RATE] = -damper.damping / damper.mass
    if damper.motor_time_constant == 0.0:
        b[STROKE_RATE, 2] = 1.0 / damper.mass
    else:
        a[STROKE_RATE, MOTOR] = 1.0 / damper.mass
        a[MOTOR, MOTOR] = -1.0 / damper.motor_time_constant
        b[MOTOR, 2] = 1.0 / damper.motor_time_constant


def lagging_matrix(length: float, table: Table, damper: Damper) -> Array:
    """Propagation over one segment of `length` s behind a table of second order; shape (6, 9)."""
    omega = 2.0 * math.pi * table.frequency
    a, b = np.zeros((MOTION, MOTION)), np.zeros((MOTION, 3))
    a[TABLE, TABLE_RATE] = 1.0
    a[TABLE_RATE, TABLE], a[TABLE_RATE, TABLE_RATE] = -(omega**2), -2.0 * table.damping_ratio * omega
    b[TABLE_RATE, 0] = omega**2
    damper_rows(a, b, damper)
    a[STROKE_RATE] -= a[TABLE_RATE]
    b[STROKE_RATE] -= b[TABLE_RATE]
    result = propagate_ramp(a, b, length, damper)
    result[ACCELERATION] = (
        -(omega**2) * result[TABLE] - 2.0 * table.damping_ratio * omega * result[TABLE_RATE]
    )
    result[ACCELERATION, COMMAND_AFTER] += omega**2
    return result


def ideal_matrix(length: float, _table: Table, damper: Damper) -> Array:
    """Propagation behind a table that follows its ramped command at once; shape (6, 9).

    The table's velocity is constant over a segment and steps at its beginning, which steps the stroke's
    velocity the other way; the acceleration is that step over the segment's length.
    """
    a, b = np.zeros((MOTION, MOTION)), np.zeros((MOTION, 3))
    damper_rows(a, b, damper)
    slope = np.zeros(WIDTH)
    slope[COMMAND_BEFORE], slope[COMMAND_AFTER] = -1.0 / length, 1.0 / length
    step = np.eye(WIDTH)
    step[STROKE_RATE] += step[TABLE_RATE] - slope
    result: Array = propagate_ramp(a, b, length, damper) @ step
    result[TABLE] = np.eye(WIDTH)[COMMAND_AFTER]
    result[TABLE_RATE] = slope
    result[ACCELERATION] = (slope - np.eye(WIDTH)[TABLE_RATE]) / length
    return result


def propagate_ramp(a: Array, b: Array, length: float, damper: Damper) -> Array:
    """Exact propagation of `ż = a·z + b·(v, –, F)` with v moving from v0 to v1 and F held; shape (6, 9).

    By one matrix exponential with the inputs as further states (Van Loan 1978). A motor without lag has
    its command for its force. The row of the acceleration is left empty.
    """
    from scipy.linalg import expm

    big = np.zeros((MOTION + 3, MOTION + 3))
    big[:MOTION, :MOTION] = a
    big[:MOTION, MOTION] = b[:, 0]
    big[MOTION, MOTION + 1] = 1.0 / length
    big[:MOTION, MOTION + 2] = b[:, 2]
    whole = expm(big * length)
    result = np.zeros((STATES, WIDTH))
    result[:MOTION, :MOTION] = whole[:MOTION, :MOTION]
    result[:MOTION, COMMAND_BEFORE] = whole[:MOTION, MOTION] - whole[:MOTION, MOTION + 1]
    result[:MOTION, COMMAND_AFTER] = whole[:MOTION, MOTION + 1]
    result[:MOTION, MOTOR_COMMAND] = whole[:MOTION, MOTION + 2]
    if damper.motor_time_constant == 0.0:
        result[MOTOR] = np.eye(WIDTH)[MOTOR_COMMAND]
    return result
