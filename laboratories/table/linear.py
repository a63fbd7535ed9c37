"""The linear part of table, damper and motor: its states and inputs, and the matrices that propagate it exactly."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from common.errors import InputError
from common.plan.laboratory_tables import Damper, ShakingTable
from models.registry import Array
from models.system import TableEffects

TABLE, TABLE_RATE, STROKE, STROKE_RATE, MOTOR, ACCELERATION = range(6)
BASE, BASE_RATE = 6, 7  # the table below an oil column's resonance, where there is one
SWING, SWING_RATE = 8, 9  # how far a mass that swings on the platform is ahead of it, where there is one
RAMP, PUSH, RAIL, DRAG = range(4)  # inputs: table command, motor force N, force g N, table friction m/s²
FLOW = 1.0  # the law of `table.second_mass` of a loop that gives way at a speed
ADDED = 2.0  # that of a mass without which the loop was tuned
BETWEEN = 2.0  # the law of `table.oil_column` whose dashpot lies between loop and platform
BEHIND_LOOP = 1.0  # the law of `table.backlash` with the play between loop and platform
# Effects of a table that its matrices hold; the others act beside them.
LINEAR = (
    "compliance",
    "oil_frequency",
    "oil_damping",
    "oil_share",
    "oil_law",
    "backlash_law",
    "second_frequency",
    "second_share",
    "second_damping",
    "second_law",
)
KEPT = 64  # matrices of tables
INPUTS = 5  # columns behind the states: command before and after, motor command, g, table friction


def propagations(
    lengths: Array,
    table: ShakingTable,
    damper: Damper,
    effects: TableEffects,
    motor_damping: float = math.inf,
) -> Array:
    """Propagation over segments of `lengths` (m,) s; shape (m, n, n + 5). It is kept and must not be written to.

    `motor_damping` is the damping ratio of a motor of second order, infinite for one of first order.

    Raises:
        InputError: an ideal table is given compliance, friction or an oil column.
    """
    if math.isinf(table.frequency):
        refuse(effects)
        return np.stack([ideal_matrix(length, damper, motor_damping) for length in lengths.tolist()])
    linear = TableEffects(**{name: getattr(effects, name) for name in LINEAR})
    loop = table.frequency, table.damping_ratio
    return lagging_matrices(tuple(lengths.tolist()), loop, damper, linear, motor_damping)


@lru_cache(maxsize=KEPT)
def lagging_matrices(
    lengths: tuple[float, ...],
    loop: tuple[float, float],
    damper: Damper,
    effects: TableEffects,
    motor_damping: float,
) -> Array:
    """`lagging_matrix` of each length; most hypotheses of a diagnosis differ in what has no part in them."""
    return np.stack([lagging_matrix(one, loop, damper, effects, motor_damping) for one in lengths])


def refuse(effects: TableEffects) -> None:
    """Refuse effects that an ideal table cannot have."""
    nulls = {
        "backlash_law": 0.0,
        "compliance": 0.0,
        "feed_velocity": 0.0,
        "friction": 0.0,
        "oil_frequency": math.inf,
        "second_frequency": math.inf,
        "velocity_limit": math.inf,
        "learned": (),
    }
    for name, null in nulls.items():
        if getattr(effects, name) != null:
            raise InputError(
                f"An ideal table (frequency inf) cannot have the effect '{name}': leave it out, or give a frequency."
            )


def damper_rows(a: Array, b: Array, damper: Damper, motor_damping: float) -> None:
    """Fill the damper's and the motor's rows of the rate matrices, the table's acceleration left out."""
    a[STROKE, STROKE_RATE] = 1.0
    a[STROKE_RATE, STROKE] = -damper.stiffness / damper.mass
    a[STROKE_RATE, STROKE_RATE] = -damper.damping / damper.mass
    b[STROKE_RATE, RAIL] = -1.0 / damper.mass
    if damper.motor_time_constant == 0.0:
        b[STROKE_RATE, PUSH] = 1.0 / damper.mass
        return
    a[STROKE_RATE, MOTOR] = 1.0 / damper.mass
    if math.isinf(motor_damping):
        a[MOTOR, MOTOR] = -1.0 / damper.motor_time_constant
        b[MOTOR, PUSH] = 1.0 / damper.motor_time_constant
        return
    omega, motor_rate = 2.0 * motor_damping / damper.motor_time_constant, a.shape[0] - 1
    a[MOTOR, motor_rate] = 1.0
    a[motor_rate, MOTOR], a[motor_rate, motor_rate] = -(omega**2), -2.0 * motor_damping * omega
    b[motor_rate, PUSH] = omega**2


def states(damper: Damper, effects: TableEffects, motor_damping: float) -> int:
    """How many states table, damper and motor have; the rate of the force of a motor of second order is the last."""
    beyond = int(math.isfinite(motor_damping) and damper.motor_time_constant > 0.0)
    if not math.isinf(effects.second_frequency):
        return SWING_RATE + 1 + beyond
    return beyond + (ACCELERATION if math.isinf(effects.oil_frequency) else BASE_RATE) + 1


def swinging(a: Array, b: Array, rate: int, omega: float, effects: TableEffects) -> None:
    """Fill the row of a mass that swings on the platform, whose acceleration is left out, and its pull at the loop."""
    second = 2.0 * math.pi * effects.second_frequency
    damped = 2.0 * effects.second_damping * second
    a[SWING, SWING_RATE] = 1.0
    a[SWING_RATE, SWING], a[SWING_RATE, SWING_RATE] = -(second**2), -damped
    share = effects.second_share
    if effects.second_law == FLOW:
        a[rate, SWING_RATE] += share / (1.0 - share) * second**2 / omega
        return
    if effects.second_law == ADDED:
        a[rate, SWING] += share / (1.0 - share) * second**2
        a[rate, SWING_RATE] += share / (1.0 - share) * damped
        return
    a[rate, SWING] += share * second**2
    a[rate, SWING_RATE] += share * damped
    a[rate] /= 1.0 - share
    b[rate] /= 1.0 - share


def lagging_matrix(
    length: float,
    loop: tuple[float, float],
    damper: Damper,
    effects: TableEffects,
    motor_damping: float,
) -> Array:
    """Propagation over one segment of `length` s for a table of second order; shape (n, n + 5).

    `loop` is the table's natural frequency (Hz) and damping ratio.

    Under the damper's force F the table gives way as if its command were changed by compliance·F.
    With an oil column the platform follows the table below it as a second oscillator, or by a share σ of its motion:
    ÿ = (1 − σ)·ẍ + ω_o²·(x − y) + 2ζ_o·ω_o·((1 − σ)·ẋ − ẏ), with x the motion of the table below it; where the dashpot
    lies between the two, ÿ = ω_o²·(x − y) + 2ζ_o·ω_o·(ẋ − ẏ).
    A mass that swings on the platform pulls at the loop, as the damper does.
    """
    size = states(damper, effects, motor_damping)
    place, rate = (BASE, BASE_RATE) if size > BASE_RATE else (TABLE, TABLE_RATE)
    omega, damping_ratio = 2.0 * math.pi * loop[0], loop[1]
    a, b = np.zeros((size, size)), np.zeros((size, 4))
    a[place, rate] = 1.0
    a[rate, place], a[rate, rate] = -(omega**2), -2.0 * damping_ratio * omega
    b[rate, RAMP], b[rate, DRAG] = omega**2, 1.0
    yielding = effects.compliance * omega**2
    a[rate, STROKE] += yielding * damper.stiffness
    a[rate, STROKE_RATE] += yielding * damper.damping
    b[rate, RAIL] += yielding
    if damper.motor_time_constant == 0.0:
        b[rate, PUSH] -= yielding
    else:
        a[rate, MOTOR] -= yielding
    if size > SWING_RATE:
        swinging(a, b, rate, omega, effects)
    if size > BASE_RATE:
        rigid = math.isinf(effects.oil_frequency)  # no oil column: the platform is where the loop is
        oil = omega if rigid else 2.0 * math.pi * effects.oil_frequency
        a[TABLE, TABLE_RATE] = 1.0
        a[TABLE_RATE, TABLE], a[TABLE_RATE, TABLE_RATE] = -(oil**2), -2.0 * effects.oil_damping * oil
        a[TABLE_RATE, BASE] = oil**2
        straight = 1.0 if rigid else 1.0 - effects.oil_share
        if straight != 0.0:
            a[TABLE_RATE] += straight * a[rate]
            a[TABLE_RATE, BASE_RATE] += straight * 2.0 * effects.oil_damping * oil
            b[TABLE_RATE] += straight * b[rate]
        if effects.oil_law == BETWEEN or effects.backlash_law == BEHIND_LOOP:  # dashpots, as those of flanks
            a[TABLE_RATE, BASE_RATE] = 2.0 * effects.oil_damping * oil
    if size > SWING_RATE:
        a[SWING_RATE] -= a[TABLE_RATE]
        b[SWING_RATE] -= b[TABLE_RATE]
    damper_rows(a, b, damper, motor_damping)
    a[STROKE_RATE] -= a[TABLE_RATE]
    b[STROKE_RATE] -= b[TABLE_RATE]
    result = propagate_ramp(a, b, length, damper)
    result[ACCELERATION] = a[TABLE_RATE] @ result
    result[ACCELERATION, size + 1] += b[TABLE_RATE, RAMP]
    if damper.motor_time_constant == 0.0:
        result[ACCELERATION, size + 2] += b[TABLE_RATE, PUSH]
    result[ACCELERATION, size + 3] += b[TABLE_RATE, RAIL]
    result[ACCELERATION, size + 4] += b[TABLE_RATE, DRAG]
    return result


def ideal_matrix(length: float, damper: Damper, motor_damping: float) -> Array:
    """Propagation over one segment of `length` s for a table that follows its ramped command at once; shape (n, n + 5).

    The table's velocity is constant over a segment and steps at its beginning, which steps the stroke's
    velocity the other way; the acceleration is that step over the segment's length.
    """
    size = states(damper, TableEffects(), motor_damping)
    a, b = np.zeros((size, size)), np.zeros((size, 4))
    damper_rows(a, b, damper, motor_damping)
    width = size + INPUTS
    slope = np.zeros(width)
    slope[size], slope[size + 1] = -1.0 / length, 1.0 / length
    step = np.eye(width)
    step[STROKE_RATE] += step[TABLE_RATE] - slope
    result: Array = propagate_ramp(a, b, length, damper) @ step
    result[TABLE] = np.eye(width)[size + 1]
    result[TABLE_RATE] = slope
    result[ACCELERATION] = (slope - np.eye(width)[TABLE_RATE]) / length
    return result


def propagate_ramp(a: Array, b: Array, length: float, damper: Damper) -> Array:
    """Exact propagation of `ż = a·z + b·(v, F, g, d)` with v moving from v0 to v1 and the others held.

    By one matrix exponential with the inputs as further states (Van Loan 1978); shape (n, n + 5). A motor
    without lag has its command as its force. The row of the acceleration is left zero.
    """
    from scipy.linalg import expm

    size = a.shape[0]
    big = np.zeros((size + 5, size + 5))
    big[:size, :size] = a
    big[:size, size] = b[:, RAMP]
    big[size, size + 1] = 1.0 / length
    big[:size, size + 2 :] = b[:, PUSH:]
    whole = expm(big * length)
    result = np.zeros((size, size + INPUTS))
    result[:, :size] = whole[:size, :size]
    result[:, ACCELERATION] = 0.0
    result[ACCELERATION] = 0.0
    result[:, size] = whole[:size, size] - whole[:size, size + 1]
    result[:, size + 1] = whole[:size, size + 1]
    result[:, size + 2 :] = whole[:size, size + 2 :]
    if damper.motor_time_constant == 0.0:
        result[MOTOR] = np.eye(size + INPUTS)[size + 2]
    return result
