"""The master's computation of one control interval: building, compensator, damper control.

    M_N·ẍ + C_N·ẋ + f_numerical(x) + specimen = −M·1·z̈ + Σ λ·damper_force

with the whole building's mass M under the ground, the numerical part's M_N and C_N, and one damper for each slave's
laboratory. At tick k the forces measured at the displacement x_k, the specimen's corrected and with `unit_delay` that
of the tick before, complete the equation of motion; the integrator then gives x_{k+1}, from which the targets of the
interval's end follow (contract, sections 2 and 3).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.plan.building import is_matrix
from common.plan.plan import Plan, resolve
from common.signals import OF_BUILDING, OF_STOREYS, SENT
from laboratories.column.kind import COLUMN
from laboratories.table.kind import TABLE
from loop.nominal import partition
from models import compensators, force_correction, integrators, specimens, trend
from models.compensators import Built as Compensator
from models.compensators import Wanted
from models.compiled import jit
from models.ground_motion import GroundMotion, ground, load
from models.integrators.state import ACCELERATION, DISPLACEMENT, NEXT_DISPLACEMENT, NEXT_VELOCITY, VELOCITY
from models.registry import Array
from models.structures import shear_building

Codes = NDArray[np.int64]

# places in `codes`, with one floor per damper from FLOORS on, in `scalars`, and of the rows of `dampers`
INTEGRATOR, SPECIMEN, STOREY, FLOORS = range(4)
INTERVAL, RATIO, REPRESENTS, HIGH_PASS, HIGH_PASS_GAIN, P_DELTA, UNIT_DELAY = range(7)
FORCE_SCALE, MOTOR_GAIN, FORCE_USED = range(3)
MATRIX = -1  # in place of a specimen's code: the numerical part is linear and coupled by a stiffness matrix
DELAYED = force_correction.CORRECTED + 1  # place in `filtered`

# places in the output row: what is the building's; what is sent to each slave; what each storey has. A signal of slaves
# or storeys takes as many places as there are of them, and its number here is its place among the signals of its group
GROUND_ACCELERATION, COLUMN_TARGET, ACTUATOR_COMMAND = (
    OF_BUILDING.index(name) for name in ("ground_acceleration", "column_target", "actuator_command")
)
OF_SLAVES = len(OF_BUILDING)  # first place of what is sent
TABLE_TARGET, DAMPER_COMMAND, TABLE_VELOCITY, TABLE_ACCELERATION, TABLE_JERK = (
    SENT.index(name)
    for name in (
        "table_target",
        "damper_command",
        "table_target_velocity",
        "table_target_acceleration",
        "table_target_jerk",
    )
)
SENT_VALUES = len(SENT)
STOREY_DISPLACEMENT, STOREY_VELOCITY, STOREY_ACCELERATION, STOREY_ABSOLUTE, STOREY_FORCE = (
    OF_STOREYS.index(name)
    for name in ("displacement", "velocity", "acceleration", "absolute_acceleration", "numerical_force")
)
STOREY_VALUES = len(OF_STOREYS)


def layout(slaves: int, storeys: int) -> dict[str, slice]:
    """Places of every signal in the output row by name, in their order; `slaves` of them, and `storeys`."""
    widths = dict.fromkeys(OF_BUILDING, 1) | dict.fromkeys(SENT, slaves) | dict.fromkeys(OF_STOREYS, storeys)
    result, end = {}, 0
    for name, width in widths.items():
        result[name] = slice(end, end + width)
        end += width
    return result


def named(rows: Array, slaves: int, storeys: int) -> dict[str, Array]:
    """Output rows (ticks, width) by signal: (ticks,) each, or with an axis for several slaves or several storeys."""
    found = {name: rows[:, place] for name, place in layout(slaves, storeys).items()}
    return {name: values[:, 0] if values.shape[1] == 1 else values for name, values in found.items()}


class Substructure(NamedTuple):
    """The numerical side with its memories, which `advance` moves on."""

    compensator: Compensator
    codes: Codes
    scalars: Array
    dampers: Array  # (3, slaves): λ, motor force over floor velocity N·s/m, and the force that a tick uses, N
    mass: Array  # (n,) kg
    coefficients: Array  # of the integrator
    column_params: Array  # (n, parameters) of the numerical columns, or (n, n) their stiffness matrix N/m
    ground: Array  # (2, ticks + 1): acceleration m/s², displacement m
    state: Array  # (rows, n) of the integrator
    column_memory: Array  # (n, memory)
    recent: Array  # (1 + slaves, RECENT): accelerations of specimen and floors, newest first, m/s²
    filtered: Array  # (3,): the column force of the tick before, measured, corrected and to be used next, N
    target: Array  # (1,): the specimen's target of the present tick, m
    balance: Array  # (n,): external minus restoring force, N
    output: Array


def build(plan: Plan, rows: Array, p_delta: float = 0.0, *, slaves: bool = True) -> Substructure:
    """The numerical side of a plan at rest; `rows` of the ground as `ground_rows` gives them.

    `p_delta` is the stiffness (N/m, negative) that gravity adds to every storey. Without `slaves` nothing is computed
    for them: a building without dampers.

    Raises:
        InputError: a model, method or parameter that the registries do not know.
    """
    column, chosen = plan.column, plan.compensator
    mass = np.array(plan.structure.mass)
    columns = numerical_columns(plan)
    method = integration(plan)
    compensator = compensators.build(chosen.kind, chosen.parameters, plan.test.interval)
    labs = [plan.of(role) for role in plan.roles] if slaves else []
    scalars = [
        plan.test.interval,
        column.deformation_ratio,
        COLUMN.coupling(plan).scale,
        *force_correction.coefficients(chosen.force, plan.test.interval),
        p_delta,
        float(chosen.force.unit_delay),
    ]
    n = plan.storeys
    floors = [lab.damper.floor - 1 for lab in labs]
    return Substructure(
        compensator,
        np.array([method.code, columns.code, column.storey - 1, *floors]),
        np.array(scalars),
        np.array([damper(lab) for lab in labs]).reshape(-1, FORCE_USED + 1).T.copy(),
        mass,
        method.coefficients,
        columns.params,
        rows,
        method.start(np.zeros(n), np.zeros(n), -mass * rows[0, 0]),
        columns.memory,
        np.zeros((1 + len(labs), trend.RECENT)),
        np.zeros(DELAYED + 1),
        np.zeros(1),
        np.zeros(n),
        np.zeros(OF_SLAVES + SENT_VALUES * len(labs) + STOREY_VALUES * n),
    )


class NumericalColumns(NamedTuple):
    """The numerical columns of every storey at rest."""

    code: int  # of their model, or MATRIX
    params: Array  # (n, parameters), or (n, n) N/m
    memory: Array  # (n, memory)


def numerical_columns(plan: Plan) -> NumericalColumns:
    """The numerical columns of a plan; raises InputError where their model or a parameter is unknown."""
    if is_matrix(plan.structure.stiffness):
        K = np.ascontiguousarray(partition.numerical(plan).K)
        return NumericalColumns(MATRIX, K, np.zeros((plan.storeys, specimens.STATE_SIZE)))
    model, own = plan.structure.columns, partition.storey_stiffnesses(plan)
    packed = [specimens.pack(model.model, stiffness=float(k), **model.parameters) for k in own]
    params, memory = (np.stack([parts[place] for parts in packed]) for place in (1, 2))
    return NumericalColumns(packed[0][0], params, memory)


def integration(plan: Plan) -> integrators.Method:
    """The plan's method for the numerical part; raises InputError where it is unknown or would diverge."""
    structure, numerical = plan.structure, partition.numerical(plan)
    chosen = integrators.INTEGRATORS.get(structure.integrator)
    K = numerical.K if chosen and chosen.of_numerical else partition.matrices(plan).K
    return integrators.build(
        structure.integrator, numerical.M, numerical.C, K, plan.test.interval, structure.rho_infinity
    )


def damper(plan: Plan) -> tuple[float, float, float]:
    """A slave's column of `dampers`; zero where the building does without the damper."""
    force_scale = TABLE.coupling(plan).scale
    return force_scale, plan.control.gain / plan.damper.force_scale if force_scale else 0.0, 0.0


def motion(plan: Plan) -> GroundMotion:
    """The record of the plan, unscaled; raises InputError where it cannot be read."""
    chosen = plan.ground_motion
    return load(chosen.record, resolve(plan, ""), chosen.dt, chosen.unit)


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
def couple(K: Array, state: Array, first: int, output: Array) -> None:
    """Storey forces (N) of the stiffness matrix K (n, n) N/m at x_k into `output` from place `first` on.

    A storey carries the sum of the restoring forces on the floors above it.
    """
    n = K.shape[0]
    shear = 0.0
    for i in range(n - 1, -1, -1):
        for j in range(n):
            shear += K[i, j] * state[NEXT_DISPLACEMENT, j]
        output[first + i] = shear


@jit
def control(building: Substructure, tick: int) -> None:
    """Targets of the tables and forces of the dampers' motors for the interval's end, into its `output`."""
    codes, dampers, ground = building.codes, building.dampers, building.ground
    state, recent, output = building.state, building.recent, building.output
    interval = building.scalars[INTERVAL]
    here, ahead = ground[1, tick], ground[1, tick + 1]
    slaves = dampers.shape[1]
    for slave in range(slaves):
        floor, past, first = codes[FLOORS + slave], recent[1 + slave], OF_SLAVES + slave
        trend.remember(past, state[ACCELERATION, floor])
        output[first + TABLE_TARGET * slaves] = state[NEXT_DISPLACEMENT, floor] + ahead
        output[first + TABLE_VELOCITY * slaves] = (
            state[NEXT_VELOCITY, floor] + (ahead - here) / interval + 0.5 * interval * ground[0, tick + 1]
        )
        output[first + TABLE_ACCELERATION * slaves] = trend.ahead(past) + ground[0, tick + 1]
        output[first + TABLE_JERK * slaves] = (
            trend.slope(past, interval) + (ground[0, tick + 1] - ground[0, tick]) / interval
        )
        output[first + DAMPER_COMMAND * slaves] = dampers[MOTOR_GAIN, slave] * state[NEXT_VELOCITY, floor]


@jit
def enter(building: tuple[Any, ...], tick: int, column_displacement: float, column_force: float) -> None:
    """`advance` for a caller outside compiled code, which holds the building as `compiled.plain` gives it."""
    whole = Substructure(Compensator(*building[0]), *building[1:])
    advance(whole, tick, column_displacement, column_force)


@jit
def advance(building: Substructure, tick: int, column_displacement: float, column_force: float) -> None:
    """One tick: from the measurements at t_k to the commands for the interval's end, into the `output`.

    `column_displacement` m and `column_force` N as measured at t_k; the dampers' forces, each at its own scale, stand
    in their row of `dampers`. The memories move on by one interval.
    """
    codes, scalars, state, output = building.codes, building.scalars, building.state, building.output
    ground, filtered = building.ground, building.filtered
    corrected = force_correction.step(scalars[HIGH_PASS], scalars[HIGH_PASS_GAIN], filtered, column_force)
    if scalars[UNIT_DELAY] != 0.0:
        corrected, filtered[DELAYED] = filtered[DELAYED], corrected
    equilibrate(building, tick, scalars[REPRESENTS] * corrected)
    interval = scalars[INTERVAL]
    integrators.step(codes[INTEGRATOR], building.coefficients, state, building.balance, interval)
    output[GROUND_ACCELERATION] = ground[0, tick]
    output[COLUMN_TARGET] = building.target[0]
    output[ACTUATOR_COMMAND] = actuate(building, column_displacement)
    control(building, tick)
    n = building.mass.size
    storeys = output.size - STOREY_VALUES * n
    for i in range(n):
        first = storeys + i
        output[first + STOREY_DISPLACEMENT * n] = state[DISPLACEMENT, i]
        output[first + STOREY_VELOCITY * n] = state[VELOCITY, i]
        output[first + STOREY_ACCELERATION * n] = state[ACCELERATION, i]
        output[first + STOREY_ABSOLUTE * n] = state[ACCELERATION, i] + ground[0, tick]


@jit
def equilibrate(building: Substructure, tick: int, specimen_force: float) -> None:
    """External minus restoring force (N) of every floor at t_k into `balance`; numerical forces into `output`.

    `specimen_force` N is what the specimen's storey feels of it.
    """
    codes, mass, dampers, state = building.codes, building.mass, building.dampers, building.state
    balance, output = building.balance, building.output
    n = mass.size
    for i in range(n):
        balance[i] = -mass[i] * building.ground[0, tick]
    for slave in range(dampers.shape[1]):
        balance[codes[FLOORS + slave]] += dampers[FORCE_SCALE, slave] * dampers[FORCE_USED, slave]
    forces = output.size - (STOREY_VALUES - STOREY_FORCE) * n
    if codes[SPECIMEN] == MATRIX:
        couple(building.column_params, state, forces, output)
    for i in range(n):
        drift = shear_building.storey_drift(state[NEXT_DISPLACEMENT], i)
        if codes[SPECIMEN] == MATRIX:
            force = output[forces + i]
        else:
            params, memory = building.column_params[i], building.column_memory[i]
            force = specimens.step(codes[SPECIMEN], params, memory, drift)
        if building.scalars[P_DELTA] != 0.0:
            force += building.scalars[P_DELTA] * drift
        output[forces + i] = force
        if i == codes[STOREY]:
            force += specimen_force
        shear_building.add_nodal(-force, i, balance)


@jit
def actuate(building: Substructure, measured: float) -> float:
    """Command (m) of the actuator for the interval's end, from the displacement `measured` (m) at t_k."""
    scalars, state, recent = building.scalars, building.state, building.recent[0]
    storey, interval, ratio = building.codes[STOREY], scalars[INTERVAL], scalars[RATIO]
    present = building.target[0]
    building.target[0] = ratio * shear_building.storey_drift(state[NEXT_DISPLACEMENT], storey)
    rate = ratio * shear_building.storey_drift(state[NEXT_VELOCITY], storey)
    trend.remember(recent, ratio * shear_building.storey_drift(state[ACCELERATION], storey))
    wanted = Wanted(
        building.target[0], rate, trend.ahead(recent), trend.slope(recent, interval), present, measured
    )
    return compensators.step(building.compensator, wanted, interval)
