"""The laboratory of the kind table: a shaking table carries the active mass damper.

Table `Y = e^(−Ls)·ω²/(s² + 2ζωs + ω²)·U`; damper `m·(s̈ + ÿ) = −k·s − c·ṡ − g + u`, motor `T·u̇ + u = F`;
force on the table `k·s + c·ṡ + g − u`, where g is the force of end stops and of the rail's friction. Without such
effects the equations are linear, so one matrix propagates table, damper and motor exactly over each segment, for a
table command that is linear in time and a motor command that is held. With them g is held over segments that are short
where it changes; the friction of a segment is the force that stops the motion within it, up to its size, so it neither
chatters nor creeps (the budget of Duclusaud et al., arXiv 2410.08650).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from common.plan.laboratory_tables import Damper, ShakingTable
from laboratories.table import coupling, segments
from laboratories.table.forces import carry, follow, put_back, resist, with_forces, within_play
from laboratories.table.linear import (
    ACCELERATION,
    BEHIND_LOOP,
    INPUTS,
    MOTOR,
    STROKE,
    STROKE_RATE,
    TABLE,
    TABLE_RATE,
    propagations,
)
from laboratories.table.record import (
    BEHIND,
    BRISTLES,
    FED,
    FED_ACCELERATION,
    FED_RATE,
    FED_TICKS,
    FED_VELOCITY,
    FORCE_LIMIT,
    FORCE_LIMIT_SHARPNESS,
    HELD,
    IDEAL,
    LAST_COMMAND,
    LAST_VELOCITY,
    MEMORIES,
    MOTOR_GAIN,
    OUTSIDE,
    PLAY,
    PLAYED,
    PRESENT,
    ROWS,
    TABLE_BRISTLES,
    TABLE_GAIN,
    TableLab,
)
from laboratories.table.steady import steady
from models import preisach
from models.compiled import jit
from models.registry import Array
from models.saturation import saturated
from models.system import DamperEffects, TableEffects
from models.transfer_systems import delay


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
    law, braked = np.array(on_damper.learned), np.array(on_table.learned)
    behind_coupling = coupling.constants(damper, on_damper)
    damper = replace(damper, mass=damper.mass - behind_coupling[0])
    numbers = segments.levels(interval, on_table, on_damper)
    taps, memory, lengths, walk = segments.divided(interval, table.delay, numbers)
    damping = on_damper.motor_damping
    rows = propagations(lengths, table, damper, on_table, damping)
    size = rows.shape[1]
    columns = np.zeros((len(rows), size + INPUTS, max(size, ROWS)))
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
    limits += [*valve(table, on_table), on_damper.asymmetry, *behind_coupling, on_table.presliding]
    limits += [*fed(interval, table, on_table), on_table.velocity_limit_sharpness]
    limits += [on_damper.damping_exponent, on_damper.stiffening, *from_outside(table, on_table, on_damper)]
    return TableLab(
        taps,
        walk,
        columns,
        lengths,
        np.array([damper.stiffness, damper.damping]),
        np.array(limits),
        np.zeros(memory),
        np.zeros(size + INPUTS + MEMORIES),
        np.zeros(columns.shape[2]),
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


def from_outside(
    table: ShakingTable, on_table: TableEffects, on_damper: DamperEffects
) -> tuple[float, float]:
    """What `limits` holds of a constant force on the damper from outside the table, from place `OUTSIDE` on."""
    outside = on_damper.offset_outside * on_damper.offset
    if on_table.compliance == 0.0:
        return outside, 0.0
    return outside, on_table.compliance * (2.0 * math.pi * table.frequency) ** 2 * outside


def fed(interval: float, table: ShakingTable, effects: TableEffects) -> tuple[float, float, float, float]:
    """What `limits` holds of velocity and acceleration of the command that are fed forward, from place `FED` on."""
    if effects.feed_velocity == 0.0 or math.isinf(table.frequency):
        return 0.0, 0.0, 0.0, 0.0
    omega = 2.0 * math.pi * table.frequency
    velocity = effects.feed_velocity * 2.0 * table.damping_ratio / omega
    share = -math.expm1(-interval / effects.feed_lag)
    return share, 1.0 / interval, velocity, effects.feed_acceleration / omega**2


@jit
def enter(lab: tuple[Any, ...], command: float, motor_command: float) -> tuple[float, float, float, float]:
    """`advance` for a caller outside compiled code, which holds the laboratory as `compiled.plain` gives it."""
    return advance(TableLab(*lab), command, motor_command)


@jit
def advance(lab: TableLab, command: float, motor_command: float) -> tuple[float, float, float, float]:
    """Table displacement (m) and acceleration (m/s²), stroke (m) and force (N) one interval later.

    The table's command is ramped to `command` (m) until then, the motor's (N) is held.
    """
    taps, walk, columns, spring, limits = lab.taps, lab.walk, lab.columns, lab.spring, lab.limits
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
        if limits[FED] > 0.0:
            command += fed_forward(limits, state, size, command)
    delay.remember(history, command)
    state[after] = delay.delayed(history, taps, 0)
    if limits[PLAY] > 0.0:
        state[after] = state[played]
    border = 0
    while border < walk.shape[1]:
        state[before] = state[after]
        i, border = walk_on(lab, border)
        if present:
            speed = state[STROKE_RATE] + state[TABLE_RATE]
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
    force += limits[OUTSIDE]
    return state[TABLE], state[ACCELERATION], state[STROKE], force


@jit
def fed_forward(limits: Array, state: Array, size: int, command: float) -> float:
    """What is fed forward (m) of velocity and acceleration of a command (m), by differences behind a filter."""
    last, rate = size + INPUTS + LAST_COMMAND, size + INPUTS + FED_RATE
    gained = limits[FED] * ((command - state[last]) * limits[FED_TICKS] - state[rate])
    state[last] = command
    state[rate] += gained
    return float(limits[FED_VELOCITY] * state[rate] + limits[FED_ACCELERATION] * gained * limits[FED_TICKS])


@jit
def walk_on(lab: TableLab, border: int) -> tuple[int, int]:
    """The longest segment from a border on over which forces are steady: the place of its length, and where it ends.

    Its inputs, and the states at its end without forces, are in `state` and `free` then.
    """
    columns, limits, state, last = lab.columns, lab.limits, lab.state, lab.walk.shape[0] - 1
    size = columns.shape[1] - INPUTS
    after, play, brush = size + 1, size + INPUTS + PLAYED, size + INPUTS + BRISTLES
    bearing = size + INPUTS + TABLE_BRISTLES
    begun, played = delay.delayed(lab.history, lab.taps, border), state[play]
    bristles = state[brush], state[bearing]
    half, i, end = 0.5 * limits[PLAY], 0, border
    for level in range(last + 1):
        i, end = lab.walk[level, border, 0], lab.walk[level, border, 1]
        if i < 0:
            continue
        wanted = delay.delayed(lab.history, lab.taps, end)
        state[after] = wanted
        if half > 0.0:
            state[play] = min(max(played, wanted - half), wanted + half)
            state[after] = state[play]
        carry(columns[i], state, lab.free)
        if limits[PRESENT] == 0.0:
            break
        state[brush], state[bearing] = bristles
        resist(columns[i], lab, lab.lengths[i])
        if level == last or steady(columns[i], lab, lab.lengths[i], bristles, played, wanted - begun):
            break
    return i, end
