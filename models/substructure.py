"""The master's computation of one control interval: building, compensator, damper control.

    M·ẍ + C·ẋ + f_numerical(x) + specimen = −M·1·z̈ + λ·damper_force

At tick k the forces measured at the displacement x_k complete the equation of motion; the integrator
then gives x_{k+1}, from which the targets of the interval's end follow (contract, sections 2 and 3).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.plan import Plan, resolve
from models import compensators, force_correction, integrators, specimens, trend
from models.compiled import jit
from models.ground_motion import GroundMotion, ground, load
from models.integrators.state import ACCELERATION, DISPLACEMENT, NEXT_DISPLACEMENT, NEXT_VELOCITY, VELOCITY
from models.registry import Array
from models.structures import shear_building

Codes = NDArray[np.int64]

# places in `codes` and `scalars`
INTEGRATOR, SPECIMEN, COMPENSATOR, STOREY, FLOOR = range(5)
INTERVAL, RATIO, REPRESENTS, FORCE_SCALE, MOTOR_GAIN, HIGH_PASS, HIGH_PASS_GAIN, P_DELTA = range(8)

# places in the output row; one value per storey each from STOREYS on
GROUND_ACCELERATION, COLUMN_TARGET, ACTUATOR_COMMAND = range(3)
TABLE_TARGET, DAMPER_COMMAND, TABLE_VELOCITY, TABLE_ACCELERATION, TABLE_JERK = range(3, 8)
STOREYS = 8
STOREY_ROWS = ("displacement", "velocity", "acceleration", "absolute_acceleration", "numerical_force")


class Substructure(NamedTuple):
    """Arrays of the numerical side, in the order `advance` takes them."""

    codes: Codes
    scalars: Array
    mass: Array  # (n,) kg
    coefficients: Array  # of the integrator
    column_params: Array  # (n, parameters) of the numerical columns
    compensator_params: Array
    ground: Array  # (2, ticks + 1): acceleration m/s², displacement m
    state: Array  # (rows, n) of the integrator
    column_memory: Array  # (n, memory)
    compensator_memory: Array
    recent: Array  # (2, RECENT): accelerations of specimen and floor at the last ticks, newest first, m/s²
    filtered: Array  # (2,): the column force of the tick before, measured and corrected, N
    target: Array  # (1,): the specimen's target of the present tick, m
    balance: Array  # (n,): external minus restoring force, N
    output: Array


def build(plan: Plan, rows: Array, p_delta: float = 0.0) -> Substructure:
    """The numerical side of a plan at rest; `rows` of the ground as `ground_rows` gives them.

    `p_delta` is the stiffness (N/m, negative) that gravity adds to every storey.

    Raises:
        InputError: a model, method or parameter that the registries do not know.
    """
    structure, column = plan.structure, plan.column
    mass, stiffness = np.array(structure.mass), np.array(structure.stiffness)
    own = stiffness.copy()
    own[column.storey - 1] *= 1.0 - column.represents / column.columns_per_storey
    model = structure.columns
    packed = [specimens.pack(model.model, stiffness=float(k), **model.parameters) for k in own]
    M, C, K = shear_building.matrices(mass, stiffness, np.array(structure.damping))
    method = integrators.build(structure.integrator, M, C, K, plan.test.interval, structure.rho_infinity)
    chosen = plan.compensator
    compensator = compensators.build(chosen.kind, chosen.parameters, plan.test.interval)
    force_scale = plan.damper.force_scale if plan.control.amd else 0.0
    motor_gain = plan.control.gain / plan.damper.force_scale if force_scale else 0.0
    scalars = [
        plan.test.interval,
        column.deformation_ratio,
        float(column.represents),
        force_scale,
        motor_gain,
        *force_correction.coefficients(plan.compensator.force, plan.test.interval),
        p_delta,
    ]
    n = plan.storeys
    return Substructure(
        np.array([method.code, packed[0][0], compensator.code, column.storey - 1, plan.damper.floor - 1]),
        np.array(scalars),
        mass,
        method.coefficients,
        np.stack([params for _, params, _ in packed]),
        compensator.params,
        rows,
        method.start(np.zeros(n), np.zeros(n), -mass * rows[0, 0]),
        np.stack([memory for _, _, memory in packed]),
        compensator.state,
        np.zeros((2, trend.RECENT)),
        np.zeros(2),
        np.zeros(1),
        np.zeros(n),
        np.zeros(STOREYS + len(STOREY_ROWS) * n),
    )


def motion(plan: Plan) -> GroundMotion:
    """The record of the plan, unscaled; raises InputError where it cannot be read."""
    return load(plan.ground_motion.record, resolve(plan, ""))


def ground_rows(plan: Plan, record: GroundMotion, shift: float = 0.0) -> Array:
    """Scaled ground acceleration (m/s²) and displacement (m) at every tick and the test's end; (2, ticks + 1).

    With a `shift` (s) the motion comes that much later, and the ground is still before and after it.
    """
    interval = plan.test.interval
    rows = ground(record.scaled(plan.ground_motion.scale), interval, plan.ticks * interval)
    return rows if shift == 0.0 else shifted(rows, shift / interval)


def shifted(rows: Array, ticks: float) -> Array:
    """Rows of the ground that come `ticks` later, by linear interpolation; the ends stay at their value."""
    places = np.arange(rows.shape[1], dtype=np.float64)
    return np.stack([np.interp(places - ticks, places, row) for row in rows])


@jit
def advance(
    codes: Codes,
    scalars: Array,
    mass: Array,
    coefficients: Array,
    column_params: Array,
    compensator_params: Array,
    ground: Array,
    state: Array,
    column_memory: Array,
    compensator_memory: Array,
    recent: Array,
    filtered: Array,
    target: Array,
    balance: Array,
    output: Array,
    tick: int,
    column_displacement: float,
    column_force: float,
    damper_force: float,
) -> None:
    """One tick: from the measurements at t_k to the commands for the interval's end, into `output`.

    `column_displacement` m and `column_force` N as measured at t_k, `damper_force` N at the damper's own
    scale as used. The arrays are those of `Substructure`; the states move on by one interval.
    """
    n = mass.size
    corrected = force_correction.step(scalars[HIGH_PASS], scalars[HIGH_PASS_GAIN], filtered, column_force)
    storey, floor = codes[STOREY], codes[FLOOR]
    interval, ratio = scalars[INTERVAL], scalars[RATIO]
    for i in range(n):
        balance[i] = -mass[i] * ground[0, tick]
    balance[floor] += scalars[FORCE_SCALE] * damper_force
    for i in range(n):
        drift = shear_building.storey_drift(state[NEXT_DISPLACEMENT], i)
        force = specimens.step(codes[SPECIMEN], column_params[i], column_memory[i], drift)
        if scalars[P_DELTA] != 0.0:
            force += scalars[P_DELTA] * drift
        output[STOREYS + 4 * n + i] = force
        if i == storey:
            force += scalars[REPRESENTS] * corrected
        shear_building.add_nodal(-force, i, balance)
    integrators.step(codes[INTEGRATOR], coefficients, state, balance, interval)

    previous_target = target[0]
    target[0] = ratio * shear_building.storey_drift(state[NEXT_DISPLACEMENT], storey)
    rate = ratio * shear_building.storey_drift(state[NEXT_VELOCITY], storey)
    trend.remember(recent[0], ratio * shear_building.storey_drift(state[ACCELERATION], storey))
    trend.remember(recent[1], state[ACCELERATION, floor])
    output[GROUND_ACCELERATION] = ground[0, tick]
    output[COLUMN_TARGET] = previous_target
    output[ACTUATOR_COMMAND] = compensators.step(
        codes[COMPENSATOR],
        compensator_params,
        compensator_memory,
        target[0],
        rate,
        trend.ahead(recent[0]),
        trend.slope(recent[0], interval),
        previous_target,
        column_displacement,
        interval,
    )
    here, ahead = ground[1, tick], ground[1, tick + 1]
    output[TABLE_TARGET] = state[NEXT_DISPLACEMENT, floor] + ahead
    output[TABLE_VELOCITY] = (
        state[NEXT_VELOCITY, floor] + (ahead - here) / interval + 0.5 * interval * ground[0, tick + 1]
    )
    output[TABLE_ACCELERATION] = trend.ahead(recent[1]) + ground[0, tick + 1]
    output[TABLE_JERK] = trend.slope(recent[1], interval) + (ground[0, tick + 1] - ground[0, tick]) / interval
    output[DAMPER_COMMAND] = scalars[MOTOR_GAIN] * state[NEXT_VELOCITY, floor]
    for i in range(n):
        output[STOREYS + i] = state[DISPLACEMENT, i]
        output[STOREYS + n + i] = state[VELOCITY, i]
        output[STOREYS + 2 * n + i] = state[ACCELERATION, i]
        output[STOREYS + 3 * n + i] = state[ACCELERATION, i] + ground[0, tick]
