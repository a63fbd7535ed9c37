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

# places in `scratch` behind the states and inputs
PLAYED, LAST_VELOCITY, BRISTLES = range(3)
MEMORIES = 3
# Of Newton's method: its error is below a millionth of the friction as long as that stops the mass, within a segment,
# over no more than a thousand times the presliding; 200 N on 16 kg do so over 0.8 µm.
CLIMBS = 7
ARRIVED = 1e-8  # of the distance: the next step would be its square, below what a number holds


class TableLab(NamedTuple):
    """The state and constants of the laboratory, which `advance` updates by one interval."""

    taps: Array  # of the delayed command
    # (m, n, n + 5): next state from state, command before and after, motor command, g, table friction
    matrices: Array
    lengths: Array  # of the segments, s
    spring: Array  # (stiffness N/m, dashpot N·s/m) of the damper
    limits: Array  # effects that are not in the matrices
    history: Array  # table commands written, newest first
    state: Array  # (n,), n = 6, or 8 with an oil column
    # (n + 8,): behind the inputs the command after the play, an ideal table's last velocity, the bristles' force
    scratch: Array
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
    short = short or law.size > 0 or braked.size > 0
    segments = delay.split(interval, table.delay, substeps(interval) if short else 1)
    alike: dict[float, Array] = {}  # equal steps differ by rounding only
    for length in segments.lengths:
        if (key := round(float(length), 12)) not in alike:
            alike[key] = propagation(float(length), table, damper, on_table)
    matrices = np.stack([alike[round(float(length), 12)] for length in segments.lengths])
    size = matrices.shape[1]
    before, behind = plays(on_table)
    limits = [float(present), on_table.gain, before, on_table.friction, on_damper.gain]
    limits += [on_damper.force_limit, on_damper.friction, on_damper.stop_stroke, on_damper.stop_stiffness]
    limits += [on_table.friction_velocity, on_damper.friction_velocity]
    limits += [interval if math.isinf(table.frequency) else 0.0, on_damper.offset]
    for part in (on_table, on_damper):
        limits += [part.friction_asymmetry, part.friction_drop, part.friction_speed]
    limits += [on_damper.presliding, *behind, on_damper.stop_exponent, on_damper.stop_damping]
    return TableLab(
        segments.taps,
        matrices,
        segments.lengths,
        np.array([damper.stiffness, damper.damping]),
        np.array(limits),
        np.zeros(segments.memory),
        np.zeros(size),
        np.zeros(size + INPUTS + MEMORIES),
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


@jit
def enter(lab: tuple[Any, ...], command: float, motor_command: float) -> tuple[float, float, float, float]:
    """`advance` for a caller outside compiled code, which holds the laboratory as `compiled.plain` gives it."""
    return advance(TableLab(*lab), command, motor_command)


@jit
def advance(lab: TableLab, command: float, motor_command: float) -> tuple[float, float, float, float]:
    """Table displacement (m) and acceleration (m/s²), stroke (m) and force (N) one interval later.

    The table's command is ramped to `command` (m) until then, the motor's (N) is held.
    """
    taps, matrices, spring, limits = lab.taps, lab.matrices, lab.spring, lab.limits
    history, state, scratch = lab.history, lab.state, lab.scratch
    size = state.size
    before, after, motor, rail, drag = size, size + 1, size + 2, size + 3, size + 4
    played, last = size + INPUTS + PLAYED, size + INPUTS + LAST_VELOCITY
    start = state[TABLE]
    present, apart = limits[PRESENT] != 0.0, 0.0
    scratch[motor] = motor_command
    scratch[rail] = 0.0
    scratch[drag] = 0.0
    if present:
        most = limits[FORCE_LIMIT]
        scratch[motor] = min(max(limits[MOTOR_GAIN] * motor_command, -most), most)
        command *= limits[TABLE_GAIN]
    delay.remember(history, command)
    scratch[after] = delay.delayed(history, taps, 0)
    if limits[PLAY] > 0.0:
        scratch[after] = scratch[played]
    for i in range(matrices.shape[0]):
        for row in range(size):
            scratch[row] = state[row]
        scratch[before] = scratch[after]
        scratch[after] = delay.delayed(history, taps, i + 1)
        if present:
            half = 0.5 * limits[PLAY]
            if half > 0.0:
                wanted = scratch[after]
                scratch[played] = min(max(scratch[played], wanted - half), wanted + half)
                scratch[after] = scratch[played]
            resist(matrices[i], lab, scratch, lab.lengths[i])
            apart = within_play(matrices[i], limits, scratch, lab.lengths[i])
            scratch[TABLE] += apart  # the platform as it would be on its spring without play
        for row in range(size):
            value = 0.0
            for column in range(size + INPUTS):
                value += matrices[i, row, column] * scratch[column]
            state[row] = value
        put_back(limits, state, apart)
    if limits[IDEAL] > 0.0:  # its velocity has steps, so the acceleration is the mean over the interval
        velocity = (state[TABLE] - start) / limits[IDEAL]
        state[ACCELERATION] = (velocity - scratch[last]) / limits[IDEAL]
        scratch[last] = velocity
    force = spring[0] * state[STROKE] + spring[1] * state[STROKE_RATE] + scratch[rail] - state[MOTOR]
    return state[TABLE], state[ACCELERATION], state[STROKE], force


@jit
def within_play(matrix: Array, limits: Array, scratch: Array, length: float) -> float:
    """How far (m) the loop is ahead of the platform when their spring is at rest, at the middle of a segment.

    In contact it is half the play. Within the play it is such that the spring and its damping together leave the drag
    of the guide.
    """
    half, guide = limits[BEHIND], limits[GUIDE]
    if half == 0.0:
        return 0.0
    speed = scratch[BASE_RATE] - scratch[TABLE_RATE]
    end = free_rate(matrix, scratch, BASE_RATE) - scratch[TABLE_RATE] - guide * length * speed
    middle = 0.5 * (speed + end)
    ahead = scratch[BASE] - scratch[TABLE] + 0.25 * length * (speed + middle)
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
def resist(matrix: Array, lab: TableLab, scratch: Array, length: float) -> None:
    """Compute a segment's forces beyond the matrices.

    Of the table's friction and law, and of the damper's stop, law and friction.
    """
    limits, size = lab.limits, matrix.shape[0]
    rail, drag = size + 3, size + 4
    scratch[rail] = -limits[OFFSET]
    scratch[drag] = 0.0
    middle = scratch[STROKE] + 0.5 * matrix[STROKE, STROKE_RATE] * scratch[STROKE_RATE]
    if abs(middle) > limits[STOP]:  # at the segment's middle, with which a bounce conserves energy
        scratch[rail] += stops.force(
            middle,
            scratch[STROKE_RATE],
            limits[STOP],
            limits[STOP_STIFFNESS],
            limits[STOP_EXPONENT],
            limits[STOP_DAMPING],
        )
    if lab.learned.size > 0:
        scratch[rail] += preisach.step(lab.learned, lab.learned_memory, middle, scratch[STROKE_RATE])
    base = BASE_RATE if size > BASE else TABLE_RATE
    if lab.braked.size > 0:
        place = scratch[base - 1] + 0.5 * matrix[base - 1, base] * scratch[base]
        scratch[drag] -= preisach.step(lab.braked, lab.braked_memory, place, scratch[base])
    if limits[TABLE_FRICTION] > 0.0:
        most = limits[TABLE_FRICTION] * rubbing(limits, TABLE_SHAPE, scratch[base], limits[TABLE_VELOCITY])
        side = limits[TABLE_SHAPE]
        scratch[drag] += stopping(matrix, scratch, base, drag, -most * (1.0 + side), most * (1.0 - side))
    if limits[FRICTION] > 0.0:
        most = limits[FRICTION] * rubbing(limits, SHAPE, scratch[STROKE_RATE], limits[VELOCITY])
        least, most = -most * (1.0 - limits[SHAPE]), most * (1.0 + limits[SHAPE])
        if limits[PRESLIDING] > 0.0:
            place = size + INPUTS + BRISTLES
            scratch[place] = bent(matrix, scratch, length, least, most, limits[PRESLIDING])
            scratch[rail] += scratch[place]
        else:
            scratch[rail] += stopping(matrix, scratch, STROKE_RATE, rail, least, most)


@jit
def rubbing(limits: Array, shape: int, rate: float, velocity: float) -> float:
    """Factor on a friction force at a rate (m/s), with the parameters of its shape from place `shape` on."""
    return friction.left(rate, velocity, limits[shape + 1], limits[shape + 2])


@jit
def stopping(matrix: Array, scratch: Array, rate: int, place: int, least: float, most: float) -> float:
    """The value of input `place` with which state `rate` is zero at the segment's end, limited to a range."""
    return min(max(-free_rate(matrix, scratch, rate) / matrix[rate, place], least), most)


@jit
def free_rate(matrix: Array, scratch: Array, rate: int) -> float:
    """The state `rate` at a segment's end under the present inputs."""
    free = 0.0
    for column in range(scratch.size - MEMORIES):
        free += matrix[rate, column] * scratch[column]
    return free


@jit
def bent(matrix: Array, scratch: Array, length: float, least: float, most: float, presliding: float) -> float:
    """Force (N) of the rail's bristles at a segment's end, if it has acted over the whole of the segment.

    The mass goes on by the velocity at the segment's end, so that stiff bristles stop it and it does not chatter; with
    ever stiffer ones this becomes `stopping`. The distance is the root of an increasing and concave function, to which
    Newton's method climbs from below.
    """
    size = matrix.shape[0]
    yields = -matrix[STROKE_RATE, size + 3]
    force = min(max(scratch[size + INPUTS + BRISTLES], least), most)
    ahead = length * (free_rate(matrix, scratch, STROKE_RATE) - yields * force)
    end = most if ahead > 0.0 else least
    far, lost = abs(ahead), length * yields * abs(end - force)
    moved = max(far / (1.0 + lost / presliding), far - lost)
    for _ in range(CLIMBS):
        left = np.exp(-moved / presliding)
        step = (far - moved - lost * (1.0 - left)) / (1.0 + lost / presliding * left)
        moved += step
        if abs(step) < ARRIVED * moved:
            break
    return friction.dahl(force, moved if ahead > 0.0 else -moved, least, most, presliding)
