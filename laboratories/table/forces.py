"""The states of the laboratory of the kind table at a segment's end, and the forces over it beyond the matrices."""

from __future__ import annotations

import math

import numpy as np

from laboratories.table import coupling
from laboratories.table.linear import (
    ACCELERATION,
    BASE,
    BASE_RATE,
    INPUTS,
    STROKE,
    STROKE_RATE,
    TABLE,
    TABLE_RATE,
)
from laboratories.table.record import (
    APART,
    APART_RATE,
    ASYMMETRY,
    BEHIND,
    BRISTLES,
    COUPLED_RATE,
    COUPLING,
    DAMPED,
    DAMPING_EXPONENT,
    FASTEST,
    FASTEST_SHARPNESS,
    FRICTION,
    GAP,
    GUIDE,
    HELD,
    LEANED,
    OFFSET,
    OPENING,
    PRESLIDING,
    ROWS,
    SECOND,
    SHAPE,
    SOFT,
    STIFFENING,
    STOP,
    STOP_DAMPING,
    STOP_EXPONENT,
    STOP_STIFFNESS,
    TABLE_BRISTLES,
    TABLE_FRICTION,
    TABLE_PRESLIDING,
    TABLE_SHAPE,
    TABLE_VELOCITY,
    VALVE,
    VELOCITY,
    WHOLE,
    TableLab,
)
from models import friction, preisach, stops
from models.compiled import jit
from models.registry import Array
from models.saturation import saturated

# Of Halley's method: four of them leave an error of rounding as long as friction stops the mass, within a segment, over
# no more than a thousand times the presliding; 200 N on 16 kg do so over 0.8 µm.
CLIMBS = 5
PACE = 0.1  # m/s, at which a dashpot with a power of the speed has the force of a linear one
ARRIVED = 1e-17  # of the distance: what is then still missing, about this much at most, is below what a number holds


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
    for row in range(ROWS, free.size):
        beyond = 0.0
        for column in range(columns.shape[0] - 2):
            beyond += columns[column, row] * state[column]
        free[row] = beyond


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
    state[drag] = limits[LEANED]
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
    if limits[ASYMMETRY] != 0.0 or limits[DAMPING_EXPONENT] != 1.0:
        rate = 0.5 * (state[STROKE_RATE] + with_forces(columns, state, lab.free, STROKE_RATE))
        state[rail] += lab.spring[1] * beyond_linear(rate, limits[ASYMMETRY], limits[DAMPING_EXPONENT])
    state[rail] += lab.spring[0] * limits[STIFFENING] * middle**3
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
    base = BASE_RATE if size > BASE_RATE else TABLE_RATE
    if limits[FASTEST] < math.inf:
        state[drag] += throttled(limits, state, size, base, length)
    if lab.braked.size > 0:
        place = state[base - 1] + 0.5 * columns[base, base - 1] * state[base]
        state[drag] -= preisach.step(lab.braked, lab.braked_memory, place, state[base])
    if limits[TABLE_FRICTION] > 0.0:
        state[drag] += bearings(columns, lab, length, base)
    if limits[FRICTION] > 0.0:
        least, most = -limits[FRICTION] * (1.0 - limits[SHAPE]), limits[FRICTION] * (1.0 + limits[SHAPE])
        left = midway(columns, lab, STROKE_RATE, rail, least, most, SHAPE, limits[VELOCITY])
        least, most = left * least, left * most
        if limits[PRESLIDING] > 0.0:
            place, yields = size + INPUTS + BRISTLES, -columns[rail, STROKE_RATE]
            state[place] = bent(
                columns, lab, length, STROKE_RATE, place, yields, (least, most), limits[PRESLIDING]
            )
            state[rail] += state[place]
        else:
            state[rail] += stopping(columns, lab, STROKE_RATE, rail, least, most)


@jit
def beyond_linear(rate: float, asymmetry: float, exponent: float) -> float:
    """What a dashpot resists with beyond a linear one, over its coefficient: a velocity (m/s) at a rate (m/s)."""
    more = asymmetry * abs(rate)
    if exponent != 1.0 and rate != 0.0:
        more += rate * ((abs(rate) / PACE) ** (exponent - 1.0) - 1.0)
    return float(more)


@jit
def bearings(columns: Array, lab: TableLab, length: float, base: int) -> float:
    """Acceleration (m/s²) that the friction of the table's bearings gives it over a segment; `base` is its rate."""
    limits, state, size = lab.limits, lab.state, columns.shape[0] - INPUTS
    drag, place = size + 4, size + INPUTS + TABLE_BRISTLES
    least = -limits[TABLE_FRICTION] * (1.0 + limits[TABLE_SHAPE])
    most = limits[TABLE_FRICTION] * (1.0 - limits[TABLE_SHAPE])
    left = midway(columns, lab, base, drag, least, most, TABLE_SHAPE, limits[TABLE_VELOCITY])
    least, most = left * least, left * most
    if limits[TABLE_PRESLIDING] == 0.0:
        return stopping(columns, lab, base, drag, least, most)
    yields = columns[drag, base]
    state[place] = bent(columns, lab, length, base, place, yields, (-most, -least), limits[TABLE_PRESLIDING])
    return -float(state[place])


@jit
def throttled(limits: Array, state: Array, size: int, base: int, length: float) -> float:
    """Acceleration (m/s²) that the table's loop lacks as its valve opens so far only, at the middle of a segment."""
    command = 0.5 * (state[size] + state[size + 1])
    wanted = limits[OPENING] * (command - state[base - 1] - 0.5 * length * state[base])
    return float(limits[VALVE] * (saturated(wanted, limits[FASTEST], limits[FASTEST_SHARPNESS]) - wanted))


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
def midway(
    columns: Array,
    lab: TableLab,
    rate: int,
    place: int,
    least: float,
    most: float,
    shape: int,
    velocity: float,
) -> float:
    """Factor on a friction at the rate (m/s) that state `rate` has in the middle of a segment.

    The friction without this factor is input `place` at one end of a range: at the end that acts against the rate.
    """
    begin = lab.state[rate]
    factor = rubbing(lab.limits, shape, begin, velocity)
    if factor == 1.0 and lab.limits[shape + 1] == 0.0:
        return factor
    gained = columns[place, rate]
    against = most if gained * begin < 0.0 else least
    end = with_forces(columns, lab.state, lab.free, rate) + gained * factor * against
    return rubbing(lab.limits, shape, 0.5 * (begin + end), velocity) if begin * end > 0.0 else factor


@jit
def stopping(columns: Array, lab: TableLab, rate: int, place: int, least: float, most: float) -> float:
    """The value of input `place` with which state `rate` is zero at the segment's end, limited to a range."""
    return min(max(-with_forces(columns, lab.state, lab.free, rate) / columns[place, rate], least), most)


@jit
def bent(
    columns: Array,
    lab: TableLab,
    length: float,
    rate: int,
    place: int,
    yields: float,
    ends: tuple[float, float],
    presliding: float,
) -> float:
    """Force of bristles against the rate at a segment's end, if it has acted over the whole of the segment.

    State `place` holds it at the beginning, and state `rate`, a velocity (m/s), loses `yields` times it over the
    segment; `ends` are the least and the largest force. The part goes on by the velocity at the segment's end, so that
    stiff bristles stop it and it does not chatter; with ever stiffer ones this becomes `stopping`. The distance is the
    root of an increasing and concave function, which Halley's method seeks from below.
    """
    least, most = ends
    force = min(max(lab.state[place], least), most)
    ahead = length * (with_forces(columns, lab.state, lab.free, rate) - yields * force)
    end = most if ahead > 0.0 else least
    far, lost = abs(ahead), length * yields * abs(end - force)
    per = 1.0 / presliding
    moved = max(far / (1.0 + lost * per), far - lost)
    left = np.exp(-moved * per)
    for _ in range(CLIMBS):
        missing = far - moved - lost * (1.0 - left)
        curved = lost * per * left
        slope = 1.0 + curved
        step = 2.0 * missing * slope / (2.0 * slope * slope - missing * curved * per)
        moved += step
        left = friction.faded(left, moved * per, step * per)
        if curved * (step * per) ** 2 * abs(step) <= ARRIVED * moved:
            break
    return float(end + (force - end) * left)
