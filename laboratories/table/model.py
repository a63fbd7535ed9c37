"""The laboratory of the kind table: a shaking table carries the active mass damper.

Table `Y = e^(−Ls)·ω²/(s² + 2ζωs + ω²)·U`; damper `m·(s̈ + ÿ) = −k·s − c·ṡ − g + u`, motor `T·u̇ + u = F`;
force on the table `k·s + c·ṡ + g − u`, where g is the force of end stops and of the rail's friction. Without such
effects the equations are linear, so one matrix propagates table, damper and motor exactly over each segment, for a
table command that is linear in time and a motor command that is held. With them g is held over short segments; the
friction of a segment is the force that stops the motion within it, up to its size, so it neither chatters nor creeps
(the budget of Duclusaud et al., arXiv 2410.08650).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from common.plan.laboratory_tables import Damper, ShakingTable
from laboratories.column.model import substeps
from laboratories.table import coupling
from laboratories.table.linear import (
    ACCELERATION,
    BASE,
    BASE_RATE,
    BEHIND_LOOP,
    INPUTS,
    MOTOR,
    STROKE,
    STROKE_RATE,
    TABLE,
    TABLE_RATE,
    propagation,
)
from models import friction, preisach, stops
from models.compiled import jit
from models.registry import Array
from models.saturation import saturated
from models.system import DamperEffects, TableEffects
from models.transfer_systems import delay

# places in `limits`
PRESENT, TABLE_GAIN, PLAY, TABLE_FRICTION, MOTOR_GAIN, FORCE_LIMIT, FRICTION, STOP, STOP_STIFFNESS = range(9)
TABLE_VELOCITY, VELOCITY = 9, 10  # below which the frictions fall off
OFFSET = 12
IDEAL = 11  # interval (s) of a table that follows at once, 0 for any other
TABLE_SHAPE, SHAPE = 13, 16  # of the frictions: asymmetry, what speed takes of them, and that speed
PRESLIDING = 19  # m, of the rail's friction
# of the play behind the loop: a half of it m, drag of the guide 1/s, 2ζ/ω of the flanks s, 1/ω² of them s²
BEHIND, GUIDE, DAMPED, SOFT = 20, 21, 22, 23
STOP_EXPONENT, STOP_DAMPING = 24, 25
FORCE_LIMIT_SHARPNESS = 26
# highest speed of the table's loop m/s, and of that loop ω/(2ζ) and 2ζω, 1/s
FASTEST, OPENING, VALVE = 27, 28, 29
ASYMMETRY = 30  # of the damper's dashpot
# of a mass behind a coupling: itself kg, spring 1/s² and dashpot 1/s over it, a half of the coupling's play m, and the
# whole mass over the first one
SECOND, COUPLING, COUPLED_RATE, GAP, WHOLE = 31, 32, 33, 34, 35

# places in `state` behind the states and inputs
PLAYED, LAST_VELOCITY, BRISTLES, APART, APART_RATE, HELD = range(6)
MEMORIES = 6
ROWS = 8  # of a column: as many with an oil column as without one, so that they are carried side by side
# Of Halley's method: four of them leave an error of rounding as long as friction stops the mass, within a segment, over
# no more than a thousand times the presliding; 200 N on 16 kg do so over 0.8 µm.
CLIMBS = 5
ARRIVED = 1e-5  # of the distance: the next step would be its cube, below what a number holds


class TableLab(NamedTuple):
    """The state and constants of the laboratory, which `advance` updates by one interval."""

    taps: Array  # of the delayed command
    # (m, n + 5, ROWS): what state, command before and after, motor command, g and table friction add to the next state
    columns: Array
    lengths: Array  # of the segments, s
    spring: Array  # (stiffness N/m, dashpot N·s/m) of the damper
    limits: Array  # effects that are not in the matrices
    history: Array  # table commands written, newest first
    # (n + 11,), n = 6, or 8 with an oil column: behind the states the inputs, the command after the play, an ideal
    # table's last velocity, the bristles' force, and of a mass behind a coupling how far it is ahead of the first one,
    # the rate of that, and the coupling's force on the first one
    state: Array
    free: Array  # (ROWS,): the states at a segment's end without g and the table's friction
    learned: Array  # a law of `models.preisach` of the stroke, empty for none
    learned_memory: Array
    braked: Array  # a law of the table's motion, m/s², empty for none
    braked_memory: Array


def build(
    interval: float,
    table: ShakingTable,
    damper: Damper,
    table_effects: TableEffects | None = None,
    damper_effects: DamperEffects | None = None,
) -> TableLab:
    """The laboratory at rest, with the parameters given and the effects on them.

    Raises:
        InputError: an ideal table is given compliance, friction or an oil column.
    """
    on_table, on_damper = table_effects or TableEffects(), damper_effects or DamperEffects()
    if on_table.backlash_law == BEHIND_LOOP and math.isinf(on_table.oil_frequency):
        on_table = replace(
            on_table, oil_frequency=on_table.flank_frequency, oil_damping=on_table.flank_damping
        )
    present = on_table != TableEffects() or on_damper != DamperEffects()
    short = on_table.backlash or on_table.friction or on_damper.friction or on_damper.stop_stiffness
    law, braked = np.array(on_damper.learned), np.array(on_table.learned)
    short = short or law.size > 0 or braked.size > 0 or on_damper.asymmetry != 0.0
    short = short or not (math.isinf(on_table.velocity_limit) and math.isinf(on_damper.second_frequency))
    behind_coupling = coupling.constants(damper, on_damper)
    damper = replace(damper, mass=damper.mass - behind_coupling[0])
    segments = delay.split(interval, table.delay, substeps(interval) if short else 1)
    alike: dict[float, Array] = {}  # equal steps differ by rounding only
    for length in segments.lengths:
        if (key := round(float(length), 12)) not in alike:
            alike[key] = propagation(float(length), table, damper, on_table)
    rows = np.stack([alike[round(float(length), 12)] for length in segments.lengths])
    size = rows.shape[1]
    columns = np.zeros((len(rows), size + INPUTS, ROWS))
    columns[:, :, :size] = rows.transpose(0, 2, 1)
    before, behind = plays(on_table)
    limits = [float(present), on_table.gain, before, on_table.friction, on_damper.gain]
    limits += [on_damper.force_limit, on_damper.friction, on_damper.stop_stroke, on_damper.stop_stiffness]
    limits += [on_table.friction_velocity, on_damper.friction_velocity]
    limits += [interval if math.isinf(table.frequency) else 0.0, on_damper.offset]
    for part in (on_table, on_damper):
        limits += [part.friction_asymmetry, part.friction_drop, part.friction_speed]
    limits += [on_damper.presliding, *behind, on_damper.stop_exponent, on_damper.stop_damping]
    limits += [on_damper.force_limit_sharpness]
    limits += [*valve(table, on_table), on_damper.asymmetry, *behind_coupling]
    return TableLab(
        segments.taps,
        columns,
        segments.lengths,
        np.array([damper.stiffness, damper.damping]),
        np.array(limits),
        np.zeros(segments.memory),
        np.zeros(size + INPUTS + MEMORIES),
        np.zeros(ROWS),
        law,
        preisach.memory(law),
        braked,
        preisach.memory(braked),
    )


def plays(effects: TableEffects) -> tuple[float, tuple[float, float, float, float]]:
    """The play before the loop (m), and what `limits` holds of that behind it from place `BEHIND` on."""
    if effects.backlash_law != BEHIND_LOOP:
        return effects.backlash, (0.0, 0.0, 0.0, 0.0)
    omega = 2.0 * math.pi * effects.oil_frequency
    return 0.0, (0.5 * effects.backlash, effects.guide, 2.0 * effects.oil_damping / omega, 1.0 / omega**2)


def valve(table: ShakingTable, effects: TableEffects) -> tuple[float, float, float]:
    """What `limits` holds of a loop whose valve opens so far only, from place `FASTEST` on."""
    if math.isinf(effects.velocity_limit):
        return math.inf, 0.0, 0.0
    omega, twice = 2.0 * math.pi * table.frequency, 2.0 * table.damping_ratio
    return effects.velocity_limit, omega / twice, twice * omega


@jit
def enter(lab: tuple[Any, ...], command: float, motor_command: float) -> tuple[float, float, float, float]:
    """`advance` for a caller outside compiled code, which holds the laboratory as `compiled.plain` gives it."""
    return advance(TableLab(*lab), command, motor_command)


@jit
def advance(lab: TableLab, command: float, motor_command: float) -> tuple[float, float, float, float]:
    """Table displacement (m) and acceleration (m/s²), stroke (m) and force (N) one interval later.

    The table's command is ramped to `command` (m) until then, the motor's (N) is held.
    """
    taps, columns, spring, limits = lab.taps, lab.columns, lab.spring, lab.limits
    history, state, free = lab.history, lab.state, lab.free
    size = columns.shape[1] - INPUTS
    before, after, motor, rail, drag = size, size + 1, size + 2, size + 3, size + 4
    played, last = size + INPUTS + PLAYED, size + INPUTS + LAST_VELOCITY
    start = state[TABLE]
    present, apart, speed = limits[PRESENT] != 0.0, 0.0, 0.0
    state[motor] = motor_command
    state[rail] = 0.0
    state[drag] = 0.0
    if present:
        wanted = limits[MOTOR_GAIN] * motor_command
        state[motor] = saturated(wanted, limits[FORCE_LIMIT], limits[FORCE_LIMIT_SHARPNESS])
        command *= limits[TABLE_GAIN]
    delay.remember(history, command)
    state[after] = delay.delayed(history, taps, 0)
    if limits[PLAY] > 0.0:
        state[after] = state[played]
    for i in range(columns.shape[0]):
        state[before] = state[after]
        state[after] = delay.delayed(history, taps, i + 1)
        if present:
            half = 0.5 * limits[PLAY]
            if half > 0.0:
                wanted = state[after]
                state[played] = min(max(state[played], wanted - half), wanted + half)
                state[after] = state[played]
        carry(columns[i], state, free)
        if present:
            speed = state[STROKE_RATE] + state[TABLE_RATE]
            resist(columns[i], lab, lab.lengths[i])
            if limits[BEHIND] > 0.0:
                apart = within_play(columns[i], limits, state, free, lab.lengths[i])
                state[TABLE] += apart  # the platform as it would be on its spring without play
                carry(columns[i], state, free)
        for row in range(size):
            state[row] = with_forces(columns[i], state, free, row)
        follow(limits, state, size, state[STROKE_RATE] + state[TABLE_RATE] - speed, lab.lengths[i])
        put_back(limits, state, apart)
    if limits[IDEAL] > 0.0:  # its velocity has steps, so the acceleration is the mean over the interval
        velocity = (state[TABLE] - start) / limits[IDEAL]
        state[ACCELERATION] = (velocity - state[last]) / limits[IDEAL]
        state[last] = velocity
    force = spring[0] * state[STROKE] + spring[1] * state[STROKE_RATE] + state[rail] - state[MOTOR]
    force += state[size + INPUTS + HELD]  # which acts between the two masses
    return state[TABLE], state[ACCELERATION], state[STROKE], force


@jit
def carry(columns: Array, state: Array, free: Array) -> None:
    """Compute the states at a segment's end without g and the table's friction, the rows side by side."""
    a = b = c = d = e = f = g = h = 0.0
    for column in range(columns.shape[0] - 2):
        value = state[column]
        a += columns[column, 0] * value
        b += columns[column, 1] * value
        c += columns[column, 2] * value
        d += columns[column, 3] * value
        e += columns[column, 4] * value
        f += columns[column, 5] * value
        g += columns[column, 6] * value
        h += columns[column, 7] * value
    free[0], free[1], free[2], free[3] = a, b, c, d
    free[4], free[5], free[6], free[7] = e, f, g, h


@jit
def with_forces(columns: Array, state: Array, free: Array, row: int) -> float:
    """A state at a segment's end with g and the table's friction as they are among the inputs."""
    rail, drag = columns.shape[0] - 2, columns.shape[0] - 1
    return float(free[row] + columns[rail, row] * state[rail] + columns[drag, row] * state[drag])


@jit
def within_play(columns: Array, limits: Array, state: Array, free: Array, length: float) -> float:
    """How far (m) the loop is ahead of the platform when their spring is at rest, at the middle of a segment.

    In contact it is half the play. Within the play it is such that the spring and its damping together leave the drag
    of the guide.
    """
    half, guide = limits[BEHIND], limits[GUIDE]
    speed = state[BASE_RATE] - state[TABLE_RATE]
    end = with_forces(columns, state, free, BASE_RATE) - state[TABLE_RATE] - guide * length * speed
    middle = 0.5 * (speed + end)
    ahead = state[BASE] - state[TABLE] + 0.25 * length * (speed + middle)
    if abs(ahead) > half:
        return half if ahead > 0.0 else -half
    return float(ahead + (limits[DAMPED] - limits[SOFT] * guide) * middle)


@jit
def put_back(limits: Array, state: Array, apart: float) -> None:
    """Put the platform back to its own place (m) after a segment, and read its acceleration (m/s²) where it is free.

    There the spring of the matrix, whose force is none on the mean of the segment, has one at its end.
    """
    if limits[BEHIND] == 0.0:
        return
    state[TABLE] -= apart
    if abs(apart) != limits[BEHIND]:
        state[ACCELERATION] = limits[GUIDE] * (state[BASE_RATE] - state[TABLE_RATE])


@jit
def resist(columns: Array, lab: TableLab, length: float) -> None:
    """Compute a segment's forces beyond the matrices, whose states at its end `carry` has found.

    Of the table's friction and law, and of the damper's stop, law and friction.
    """
    limits, state, size = lab.limits, lab.state, columns.shape[0] - INPUTS
    rail, drag = size + 3, size + 4
    state[rail] = -limits[OFFSET]
    state[drag] = 0.0
    middle = state[STROKE] + 0.5 * columns[STROKE_RATE, STROKE] * state[STROKE_RATE]
    if abs(middle) > limits[STOP]:  # at the segment's middle, with which a bounce conserves energy
        state[rail] += stops.force(
            middle,
            state[STROKE_RATE],
            limits[STOP],
            limits[STOP_STIFFNESS],
            limits[STOP_EXPONENT],
            limits[STOP_DAMPING],
        )
    if limits[ASYMMETRY] != 0.0:
        rate = 0.5 * (state[STROKE_RATE] + with_forces(columns, state, lab.free, STROKE_RATE))
        state[rail] += limits[ASYMMETRY] * lab.spring[1] * abs(rate)
    if limits[SECOND] > 0.0:
        state[size + INPUTS + HELD] = coupling.force(
            state[size + INPUTS + APART],
            state[size + INPUTS + APART_RATE],
            length,
            limits[SECOND],
            limits[COUPLING],
            limits[COUPLED_RATE],
            limits[GAP],
            limits[WHOLE],
        )
        state[rail] -= state[size + INPUTS + HELD]
    if lab.learned.size > 0:
        state[rail] += preisach.step(lab.learned, lab.learned_memory, middle, state[STROKE_RATE])
    base = BASE_RATE if size > BASE else TABLE_RATE
    if limits[FASTEST] < math.inf:
        state[drag] += throttled(limits, state, size, base, length)
    if lab.braked.size > 0:
        place = state[base - 1] + 0.5 * columns[base, base - 1] * state[base]
        state[drag] -= preisach.step(lab.braked, lab.braked_memory, place, state[base])
    if limits[TABLE_FRICTION] > 0.0:
        most = limits[TABLE_FRICTION] * rubbing(limits, TABLE_SHAPE, state[base], limits[TABLE_VELOCITY])
        side = limits[TABLE_SHAPE]
        state[drag] += stopping(columns, lab, base, drag, -most * (1.0 + side), most * (1.0 - side))
    if limits[FRICTION] > 0.0:
        most = limits[FRICTION] * rubbing(limits, SHAPE, state[STROKE_RATE], limits[VELOCITY])
        least, most = -most * (1.0 - limits[SHAPE]), most * (1.0 + limits[SHAPE])
        if limits[PRESLIDING] > 0.0:
            place = size + INPUTS + BRISTLES
            state[place] = bent(columns, lab, length, least, most, limits[PRESLIDING])
            state[rail] += state[place]
        else:
            state[rail] += stopping(columns, lab, STROKE_RATE, rail, least, most)


@jit
def throttled(limits: Array, state: Array, size: int, base: int, length: float) -> float:
    """Acceleration (m/s²) that the table's loop lacks as its valve opens so far only, at the middle of a segment."""
    command = 0.5 * (state[size] + state[size + 1])
    wanted = limits[OPENING] * (command - state[base - 1] - 0.5 * length * state[base])
    return float(limits[VALVE] * (min(max(wanted, -limits[FASTEST]), limits[FASTEST]) - wanted))


@jit
def follow(limits: Array, state: Array, size: int, gained: float, length: float) -> None:
    """Move the mass behind the coupling over a segment in which the first one has gained a speed (m/s)."""
    if limits[SECOND] == 0.0:
        return
    place, rate = size + INPUTS + APART, size + INPUTS + APART_RATE
    state[place] += 0.5 * length * state[rate]
    state[rate] -= gained + length * state[size + INPUTS + HELD] / limits[SECOND]
    state[place] += 0.5 * length * state[rate]


@jit
def rubbing(limits: Array, shape: int, rate: float, velocity: float) -> float:
    """Factor on a friction force at a rate (m/s), with the parameters of its shape from place `shape` on."""
    return friction.left(rate, velocity, limits[shape + 1], limits[shape + 2])


@jit
def stopping(columns: Array, lab: TableLab, rate: int, place: int, least: float, most: float) -> float:
    """The value of input `place` with which state `rate` is zero at the segment's end, limited to a range."""
    return min(max(-with_forces(columns, lab.state, lab.free, rate) / columns[place, rate], least), most)


@jit
def bent(columns: Array, lab: TableLab, length: float, least: float, most: float, presliding: float) -> float:
    """Force (N) of the rail's bristles at a segment's end, if it has acted over the whole of the segment.

    The mass goes on by the velocity at the segment's end, so that stiff bristles stop it and it does not chatter; with
    ever stiffer ones this becomes `stopping`. The distance is the root of an increasing and concave function, which
    Halley's method seeks from below.
    """
    size = columns.shape[0] - INPUTS
    yields = -columns[size + 3, STROKE_RATE]
    force = min(max(lab.state[size + INPUTS + BRISTLES], least), most)
    ahead = length * (with_forces(columns, lab.state, lab.free, STROKE_RATE) - yields * force)
    end = most if ahead > 0.0 else least
    far, lost = abs(ahead), length * yields * abs(end - force)
    per = 1.0 / presliding
    moved = max(far / (1.0 + lost * per), far - lost)
    for _ in range(CLIMBS):
        left = np.exp(-moved * per)
        missing = far - moved - lost * (1.0 - left)
        curved = lost * per * left
        slope = 1.0 + curved
        step = 2.0 * missing * slope / (2.0 * slope * slope - missing * curved * per)
        moved += step
        if abs(step) <= ARRIVED * moved:
            break
    return friction.dahl(force, moved if ahead > 0.0 else -moved, least, most, presliding)
