"""The master's computation of one control interval: the building, and the commands of its laboratories.

    M_N·ẍ + C_N·ẋ + f_numerical(x) + Σ λ·f_drift = −M·1·z̈ + Σ λ·f_floor

M is the mass of the whole building, M_N and C_N belong to the numerical part, and each laboratory has one force f at
its scale λ: a laboratory that follows a storey's drift resists it, one that follows a floor pushes it. At tick k the
forces measured at the displacement x_k, corrected, and with `unit_delay` those of the tick before, complete the
equation of motion. The integrator then gives x_{k+1}, from which the targets for the interval's end follow. The
compensator of the master's own laboratory, where it has one, is part of the computation.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.plan.plan import Plan, resolve
from common.roles import MASTER
from common.signals import OF_STOREYS
from laboratories.kinds import kinds_of
from loop.names import sent_names
from models import compensators, force_correction, integrators, specimens, trend
from models.compensators import Built as Compensator
from models.compensators.wanted import Wanted
from models.compiled import jit
from models.ground_motion import GroundMotion, ground, load
from models.integrators.state import ACCELERATION, DISPLACEMENT, NEXT_DISPLACEMENT, NEXT_VELOCITY, VELOCITY
from models.registry import Array
from models.structures import shear_building
from models.transfer_systems import delay

Codes = NDArray[np.int64]

# places in `codes` and in `scalars`; rows of `places` and of `labs`, which have a column for each laboratory
INTEGRATOR, SPECIMEN, OWN = range(
    3
)  # OWN is 1 if the master has a laboratory, which is then the first column
INTERVAL, P_DELTA = range(2)
FOLLOWED, PLACE = range(2)
RATIO, FORCE_SCALE, MOTOR_GAIN, HIGH_PASS, HIGH_PASS_GAIN, UNIT_DELAY, FORCE_USED, EXERTED = range(8)
DRIFT, FLOOR = range(2)  # the motion that a laboratory follows
MATRIX = -1  # in place of a specimen's code: the numerical part is linear with a stiffness matrix
DELAYED = force_correction.CORRECTED + 1  # place in a row of `filtered`

# places in the output row: the values of the ground and of the master's own laboratory; then the values sent, slave by
# slave; then the values of the storeys, signal by signal
GROUND_ACCELERATION, TARGET, COMMAND, EFFORT = range(4)
OF_SLAVES = 4  # first place of the values sent
SENT_TARGET, SENT_EFFORT, SENT_VELOCITY, SENT_ACCELERATION, SENT_JERK = range(5)  # to one slave
SENT_VALUES = 5
STOREY_VALUES = len(OF_STOREYS)
STOREY_DISPLACEMENT, STOREY_VELOCITY, STOREY_ACCELERATION, STOREY_ABSOLUTE, STOREY_FORCE = range(5)


def layout(plan: Plan, slaves: Sequence[str]) -> dict[str, list[int]]:
    """Places in the output row by signal of the master's topic; `slaves` are the roles that take part.

    A signal of several slaves of one kind, or of storeys, has a place for each of them.
    """
    hosted, n = kinds_of(plan), plan.storeys
    result = {"ground_acceleration": [GROUND_ACCELERATION]}
    if MASTER in hosted:
        own = hosted[MASTER].channels
        result |= {own.target.name: [TARGET], own.command.name: [COMMAND]}
        result |= {own.effort.name: [EFFORT]} if own.effort else {}
    names = sent_names(plan)
    for place, role in enumerate(slaves):
        motor = hosted[role].channels.effort is not None
        values = [value for value in range(SENT_VALUES) if motor or value != SENT_EFFORT]
        for name, value in zip(names[role], values, strict=True):
            result.setdefault(name, []).append(OF_SLAVES + SENT_VALUES * place + value)
    first = OF_SLAVES + SENT_VALUES * len(slaves)
    return result | {
        name: [first + i * n + storey for storey in range(n)] for i, name in enumerate(OF_STOREYS)
    }


def named(rows: Array, plan: Plan, slaves: Sequence[str]) -> dict[str, Array]:
    """Output rows (ticks, width) by signal: (ticks,) each, or with an axis for several slaves or several storeys."""
    return {
        name: rows[:, places[0]] if len(places) == 1 else rows[:, places]
        for name, places in layout(plan, slaves).items()
    }


class Substructure(NamedTuple):
    """The numerical substructure with its state, which `advance` updates."""

    compensator: Compensator  # of the master's own laboratory
    codes: Codes
    scalars: Array
    places: Codes  # (2, laboratories): the motion that each follows, and its storey or floor, from 0
    labs: Array  # (8, laboratories): target over motion, λ, motor force over velocity N·s/m, correction, forces N
    mass: Array  # (n,) kg
    coefficients: Array  # of the integrator
    column_params: Array  # (n, parameters) of the numerical columns, or (n, n) their stiffness matrix N/m
    ground: Array  # (2, ticks + 1): acceleration m/s², displacement m
    state: Array  # (rows, n) of the integrator
    column_memory: Array  # (n, memory)
    recent: Array  # (laboratories, RECENT): accelerations of the motion that each follows, newest first, m/s²
    filtered: Array  # (laboratories, 3): force of the tick before, measured, corrected and to be used next, N
    asked: Array  # (5,): values for the master's own laboratory; the target is that of the present tick
    balance: Array  # (n,): external minus restoring force, N
    output: Array


def motion(plan: Plan) -> GroundMotion:
    """The record of the plan, unscaled; raises InputError where it cannot be read."""
    chosen = plan.ground_motion
    return load(chosen.record, resolve(plan, ""), chosen.dt, chosen.unit)


def ground_rows(plan: Plan, record: GroundMotion, shift: float = 0.0) -> Array:
    """Scaled ground acceleration (m/s²) and displacement (m) at every tick and the test's end; (2, ticks + 1).

    With a `shift` (s) the motion comes later by it, and the ground is at rest before and after.
    """
    interval = plan.test.interval
    rows = ground(record.scaled(plan.ground_motion.scale), interval, plan.ticks * interval)
    return rows if shift == 0.0 else shifted(rows, shift / interval)


def recorded_ground(plan: Plan) -> tuple[GroundMotion, Array] | None:
    """The plan's record and its rows for a recording; None if a client has the building and its own ground motion.

    Raises:
        InputError: it cannot be read.
    """
    if plan.served:
        return None
    record = motion(plan)
    return record, ground_rows(plan, record)


def shifted(rows: Array, ticks: float) -> Array:
    """Rows of the ground that come `ticks` later, by linear interpolation; the ends stay at their value."""
    places = np.arange(rows.shape[1], dtype=np.float64)
    return np.stack([np.interp(places - ticks, places, row) for row in rows])


@jit
def couple(K: Array, state: Array, first: int, output: Array) -> None:
    """Write the storey forces (N) of the stiffness matrix K (n, n) N/m at x_k into `output` from place `first` on.

    A storey carries the sum of the restoring forces on the floors above it.
    """
    n = K.shape[0]
    shear = 0.0
    for i in range(n - 1, -1, -1):
        for j in range(n):
            shear += K[i, j] * state[NEXT_DISPLACEMENT, j]
        output[first + i] = shear


def forces(building: Substructure) -> Array:
    """The slaves' measured forces (slaves,) N that the next tick uses: a view, which the caller fills."""
    return building.labs[FORCE_USED, building.codes[OWN] :]


@jit
def receive(building: Substructure, slave: int, force: float) -> None:
    """Set the measured force (N) of a slave that the next tick uses."""
    building.labs[FORCE_USED, building.codes[OWN] + slave] = force


@jit
def tell(building: Substructure, lab: int, tick: int, told: Array, first: int) -> None:
    """Write the values for a laboratory at the interval's end into `told` from place `first` on."""
    place, followed = building.places[PLACE, lab], building.places[FOLLOWED, lab]
    labs, state, past = building.labs, building.state, building.recent[lab]
    interval, ratio, ground = building.scalars[INTERVAL], labs[RATIO, lab], building.ground
    if followed == DRIFT:
        rate = shear_building.storey_drift(state[NEXT_VELOCITY], place)
        delay.remember(past, ratio * shear_building.storey_drift(state[ACCELERATION], place))
        told[first + SENT_TARGET] = ratio * shear_building.storey_drift(state[NEXT_DISPLACEMENT], place)
        told[first + SENT_VELOCITY] = ratio * rate
        steep = trend.steepness(past)
        told[first + SENT_ACCELERATION] = trend.ahead(past, steep)
        told[first + SENT_JERK] = steep / interval
    else:
        rate = state[NEXT_VELOCITY, place]
        here, ahead = ground[1, tick], ground[1, tick + 1]
        delay.remember(past, state[ACCELERATION, place])
        steep = trend.steepness(past)
        told[first + SENT_TARGET] = ratio * (state[NEXT_DISPLACEMENT, place] + ahead)
        told[first + SENT_VELOCITY] = ratio * (
            rate + (ahead - here) / interval + 0.5 * interval * ground[0, tick + 1]
        )
        told[first + SENT_ACCELERATION] = ratio * (trend.ahead(past, steep) + ground[0, tick + 1])
        told[first + SENT_JERK] = ratio * (
            steep / interval + (ground[0, tick + 1] - ground[0, tick]) / interval
        )
    told[first + SENT_EFFORT] = labs[MOTOR_GAIN, lab] * rate


@jit
def enter(building: tuple[Any, ...], tick: int, position: float, force: float) -> None:
    """`advance` for a caller outside compiled code, which holds the building as `compiled.plain` gives it."""
    whole = Substructure(Compensator(*building[0]), *building[1:])
    advance(whole, tick, position, force)


@jit
def advance(building: Substructure, tick: int, position: float, force: float) -> None:
    """Compute one tick: from the measurements at t_k to the commands for the interval's end, which go into `output`.

    `position` (m) and `force` (N) are those of the master's own laboratory measured at t_k; the slaves' forces, each at
    its own scale, must have been given to `receive`. The state advances by one interval.
    """
    compute(building, tick, force)
    if building.codes[OWN]:
        actuate(building, position)


@jit
def enter_building(building: tuple[Any, ...], tick: int, force: float) -> None:
    """`compute` for a caller outside compiled code, which holds the building as `compiled.plain` gives it."""
    whole = Substructure(Compensator(*building[0]), *building[1:])
    compute(whole, tick, force)


@jit
def compute(building: Substructure, tick: int, force: float) -> None:
    """A tick without the compensator of the master's own laboratory; its values at the interval's end go into `asked`.

    Otherwise as `advance`.
    """
    codes, scalars, state, output = building.codes, building.scalars, building.state, building.output
    ground, own = building.ground, codes[OWN]
    if own:
        building.labs[FORCE_USED, 0] = force
    exert(building)
    equilibrate(building, tick)
    interval = scalars[INTERVAL]
    integrators.step(codes[INTEGRATOR], building.coefficients, state, building.balance, interval)
    output[GROUND_ACCELERATION] = ground[0, tick]
    if own:
        output[TARGET] = building.asked[SENT_TARGET]
        tell(building, 0, tick, building.asked, 0)
    for lab in range(own, building.labs.shape[1]):
        tell(building, lab, tick, output, OF_SLAVES + SENT_VALUES * (lab - own))
    n = building.mass.size
    storeys = output.size - STOREY_VALUES * n
    for i in range(n):
        first = storeys + i
        output[first + STOREY_DISPLACEMENT * n] = state[DISPLACEMENT, i]
        output[first + STOREY_VELOCITY * n] = state[VELOCITY, i]
        output[first + STOREY_ACCELERATION * n] = state[ACCELERATION, i]
        output[first + STOREY_ABSOLUTE * n] = state[ACCELERATION, i] + ground[0, tick]


@jit
def exert(building: Substructure) -> None:
    """Compute the force (N) of every laboratory on the building at t_k from the measured one, corrected and scaled."""
    labs = building.labs
    for lab in range(labs.shape[1]):
        filtered = building.filtered[lab]
        corrected = force_correction.step(
            labs[HIGH_PASS, lab], labs[HIGH_PASS_GAIN, lab], filtered, labs[FORCE_USED, lab]
        )
        if labs[UNIT_DELAY, lab] != 0.0:
            corrected, filtered[DELAYED] = filtered[DELAYED], corrected
        labs[EXERTED, lab] = labs[FORCE_SCALE, lab] * corrected


@jit
def equilibrate(building: Substructure, tick: int) -> None:
    """Write external minus restoring force (N) of every floor at t_k into `balance`, numerical forces into `output`."""
    codes, mass, places, labs = building.codes, building.mass, building.places, building.labs
    state, balance, output = building.state, building.balance, building.output
    n = mass.size
    for i in range(n):
        balance[i] = -mass[i] * building.ground[0, tick]
    for lab in range(labs.shape[1]):
        if places[FOLLOWED, lab] == FLOOR:
            balance[places[PLACE, lab]] += labs[EXERTED, lab]
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
        for lab in range(labs.shape[1]):
            if places[FOLLOWED, lab] == DRIFT and places[PLACE, lab] == i:
                force += labs[EXERTED, lab]
        shear_building.add_nodal(-force, i, balance)


@jit
def actuate(building: Substructure, measured: float) -> None:
    """Write command and effort of the master's own laboratory into `output`; `measured` is its position, m."""
    asked, output = building.asked, building.output
    wanted = Wanted(
        asked[SENT_TARGET],
        asked[SENT_VELOCITY],
        asked[SENT_ACCELERATION],
        asked[SENT_JERK],
        output[TARGET],
        measured,
    )
    output[COMMAND] = compensators.step(building.compensator, wanted, building.scalars[INTERVAL])
    output[EFFORT] = asked[SENT_EFFORT]
