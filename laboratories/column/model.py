"""The laboratory of the kind column: a hydraulic actuator deforms a specimen.

The actuator is a lag with dead time, whose motion does not depend on the specimen, or servo-hydraulics whose force
moves the specimen's mass. Effects apply to either: valve overlap removes small errors of the loop, the flow of the
valve limits the piston's velocity, and oil and frame are compliant under load; the lag may also be of second order, and
have play in its clevis or before its loop. A law learned from a recording adds to the motion of the lag.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.laboratory_tables import Actuator, Column
from laboratories.column import specimen
from laboratories.column.specimen import REACTION, Specimen
from models import preisach
from models.compiled import jit
from models.registry import Array
from models.saturation import saturated
from models.system import ActuatorEffects, ColumnEffects
from models.transfer_systems import delay, second_order, servo_hydraulic

# s, longest step with an effect that is not linear over an interval: an eighth of 2 ms, in which the signals of a test
# (below 20 Hz) turn by less than 2°
SUBSTEP = 0.25e-3
# s, the same for servo-hydraulics, where a part of the force is held over a step: 0.016 rad of the default valve's 316
# rad/s
FINE_SUBSTEP = 0.05e-3
SETTLING = 1.0  # s, in which `begin` ramps servo-hydraulics to a command, and in which they then settle

# places in `state`: the lag's piston before compliance and play m, specimen m, load cell N, command behind a play
# before the loop m, piston from specimen within a greased play m, the lag's speed m/s, states of servo-hydraulics
SERVO, DISPLACEMENT, FORCE, PLAYED, LOOSE, SERVO_RATE, STATES = range(7)

# places in `limits`; for servo-hydraulics GAIN is that of the command, and VELOCITY_LIMIT is given as a flow
PRESENT, VELOCITY_LIMIT, BACKLASH, COMPLIANCE, DEADBAND, GAIN, STIFFNESS, HELD, HYDRAULIC, BEYOND, BEFORE = (
    range(11)
)
# LOAD: compliance within the loop
SPRING_BACK, LEAKING, NULL_GAIN, LOAD, SHARPNESS, STALL = range(11, 17)
WITHIN_LOOP = 1.0  # law of `actuator.compliance`: the load takes from the error of the loop
# laws of `actuator.deadband`: an overlap whose edges leak, and one that leaks all over
EDGES_LEAK, LANDS_LEAK = 1.0, 2.0
# laws of `actuator.backlash`: the play between command and loop, and greased play behind the loop
BEFORE_LOOP, GREASED = 1.0, 2.0


class ColumnLab(NamedTuple):
    """The state and constants of the laboratory, which `advance` updates by one interval."""

    taps: Array  # of the delayed command
    rows: Array  # of the actuator's propagation
    lengths: Array  # of the segments, s
    limits: Array  # effects on the actuator
    history: Array  # commands written, newest first
    state: Array
    specimen: Specimen
    learned: Array  # a law of `models.preisach` for the piston's position, empty for none
    learned_memory: Array


def build(
    interval: float,
    actuator: Actuator,
    column: Column,
    actuator_effects: ActuatorEffects | None = None,
    column_effects: ColumnEffects | None = None,
) -> ColumnLab:
    """The laboratory at rest, with the system's parameters and effects.

    Raises:
        InputError: parameters of the specimen are not valid, or servo-hydraulics are given backlash, a gradual limit
            of the velocity or no mass.
    """
    on_actuator, on_column = actuator_effects or ActuatorEffects(), column_effects or ColumnEffects()
    if actuator.model == "servo_hydraulic":
        return hydraulic(interval, actuator, column, on_actuator, on_column)
    present = on_actuator != ActuatorEffects()
    rated = actuator.time_constant > 0.0 and bool(column.mass or column.damping)
    short = present or rated or specimen.needs_substeps(on_column)
    segments = delay.split(
        interval, actuator.delay, substeps(interval) if short else 1, held=actuator.command == "held"
    )
    rows = second_order.propagators(
        actuator.gain, actuator.time_constant, on_actuator.lag_damping, segments.lengths
    )
    before, behind = plays(on_actuator)
    behind_loop, within = compliances(on_actuator)
    limits = [float(present), on_actuator.velocity_limit, behind, behind_loop]
    limits += [on_actuator.deadband, actuator.gain, column.stiffness, float(actuator.command == "held")]
    law = np.array(on_actuator.learned)
    return ColumnLab(
        segments.taps,
        rows,
        segments.lengths,
        np.array([*limits, 0.0, 0.0, before, *formulas(on_actuator), within, *valve(on_actuator)]),
        np.zeros(segments.memory),
        np.zeros(STATES),
        specimen.build(column, on_column),
        law,
        preisach.memory(law),
    )


def plays(effects: ActuatorEffects) -> tuple[float, float]:
    """The whole play (m) before and behind the loop."""
    if effects.backlash_law == BEFORE_LOOP:
        return effects.backlash, 0.0
    return 0.0, effects.backlash


def compliances(effects: ActuatorEffects) -> tuple[float, float]:
    """The compliance (m/N) behind and within the loop."""
    if effects.compliance_law == WITHIN_LOOP:
        return 0.0, effects.compliance
    return effects.compliance, 0.0


def valve(effects: ActuatorEffects) -> tuple[float, float]:
    """The sharpness with which the speed bends at its limit, and the load (N) at which the piston stands."""
    return effects.velocity_limit_sharpness, effects.stall_force


def formulas(effects: ActuatorEffects) -> tuple[float, float, float]:
    """The time (s) in which a specimen springs back through play, 0 where it is dry, and how an overlap leaks.

    That is whether its edges do, and the flow gain at null over that outside.
    """
    back = effects.spring_back if effects.backlash_law == GREASED else 0.0
    null_gain = effects.null_gain if effects.deadband_law == LANDS_LEAK else 0.0
    return back, float(effects.deadband_law == EDGES_LEAK), null_gain


def hydraulic(
    interval: float,
    actuator: Actuator,
    column: Column,
    on_actuator: ActuatorEffects,
    on_column: ColumnEffects,
) -> ColumnLab:
    """The laboratory with servo-hydraulics; mass, dashpot and initial stiffness of the specimen are in their loop."""
    servo, mass, damping = actuator.servo, column.mass + on_column.inertia, column.damping + on_column.viscous
    if mass <= 0.0:
        raise InputError(
            "mass in [column] must be above 0 kg, because the actuator 'servo_hydraulic' moves it by its force: give "
            "the moving mass."
        )
    if on_actuator.backlash:
        raise InputError(
            "The actuator 'servo_hydraulic' cannot have the effect 'actuator.backlash', because its piston carries the "
            "specimen's mass: leave it out, or choose 'fopdt'."
        )
    if math.isfinite(on_actuator.velocity_limit_sharpness):
        raise InputError(
            "The actuator 'servo_hydraulic' cannot have the effect 'actuator.velocity_limit' with law 1, because its "
            "valve has a dynamics of its own: give law 0 or 2, or choose 'fopdt'."
        )
    if on_column.viscous and on_column.viscous_law:
        raise InputError(
            "The actuator 'servo_hydraulic' cannot have the effect 'column.viscous' with a law but 0, because its "
            "piston moves against a dashpot that is linear: give law 0, or choose 'fopdt'."
        )
    bare = replace(column, mass=0.0, damping=0.0)
    on_column = replace(on_column, viscous=0.0, inertia=0.0)
    behind, within = compliances(on_actuator)
    a, b = servo_hydraulic.rates(servo, column.stiffness, damping, mass, behind, within)
    beyond = column.model != "linear" or on_column != ColumnEffects()
    limited = math.isfinite(on_actuator.velocity_limit) or on_actuator.deadband > 0.0
    steps = max(1, math.ceil(interval / FINE_SUBSTEP - 1e-9)) if beyond or limited else 1
    held = actuator.command == "held"
    segments = delay.split(interval, servo.delay, steps, held=held)
    limits = [float(limited), on_actuator.velocity_limit * servo.piston, 0.0, behind]
    limits += [on_actuator.deadband, servo.gain, column.stiffness, float(held), 1.0, float(beyond), 0.0]
    limits += [*formulas(on_actuator), within, *valve(on_actuator)]
    return ColumnLab(
        segments.taps,
        servo_hydraulic.propagators(a, b, segments.lengths),
        segments.lengths,
        np.array(limits),
        np.zeros(segments.memory),
        np.zeros(STATES + servo_hydraulic.STATES),
        specimen.build(bare, on_column),
        preisach.NONE,
        preisach.NONE,
    )


def substeps(interval: float) -> int:
    """The number of steps of an interval (s) with effects that need short steps."""
    return max(1, math.ceil(interval / SUBSTEP - 1e-9))


def begin(lab: ColumnLab, command: float, interval: float) -> None:
    """Bring a laboratory at rest to the steady state of a constant command (m); `interval` in s."""
    if lab.limits[HYDRAULIC] != 0.0:
        ticks = math.ceil(SETTLING / interval)
        for tick in range(2 * ticks):
            advance(lab, command * min(tick / ticks, 1.0))
        return
    lab.history[:] = command
    lab.state[PLAYED] = command
    there = lab.limits[GAIN] * command
    lab.state[:FORCE] = there
    lab.state[FORCE] = specimen.force(lab.specimen, there, interval)
    lab.specimen.cell[specimen.RATE] = lab.specimen.cell[specimen.LAST_STEP] = 0.0


@jit
def enter(lab: tuple[Any, ...], command: float) -> tuple[float, float]:
    """`advance` for a caller outside compiled code, which holds the laboratory as `compiled.plain` gives it."""
    taps, rows, lengths, limits, history, state, tested, learned, memory = lab
    whole = ColumnLab(taps, rows, lengths, limits, history, state, Specimen(*tested), learned, memory)
    return advance(whole, command)


@jit
def advance(lab: ColumnLab, command: float) -> tuple[float, float]:
    """Displacement (m) and force (N) one interval later, the command ramped to `command` (m) by then or held."""
    taps, rows, lengths, limits, state = lab.taps, lab.rows, lab.lengths, lab.limits, lab.state
    history, tested, cell = lab.history, lab.specimen, lab.specimen.cell
    delay.remember(history, command)
    displacement, force = state[DISPLACEMENT], state[FORCE]
    reached = displacement
    half = 0.5 * limits[BEFORE]
    before = state[PLAYED] if half > 0.0 else delay.delayed(history, taps, 0)
    for i in range(rows.shape[0]):
        after = delay.delayed(history, taps, i + 1)
        if half > 0.0:
            after = min(max(before, after - half), after + half)
        if limits[HELD] != 0.0:
            before = after
        if limits[HYDRAULIC] != 0.0:
            excess = cell[REACTION] - limits[STIFFNESS] * displacement if limits[BEYOND] != 0.0 else 0.0
            lost = overlapped(limits, state, 0.5 * (before + after))
            servo_hydraulic.step(rows[i], state, STATES, before - lost, after - lost, excess)
            choked(limits, state)
            displacement = state[STATES + servo_hydraulic.POSITION]
            reached = displacement
            force = state[STATES + servo_hydraulic.FORCE]
            if limits[BEYOND] != 0.0:
                specimen.force(tested, displacement, lengths[i])
        else:
            displacement = lagged(lab, i, before, after, displacement)
            reached = displacement
            if lab.learned.size > 0:
                way = (displacement - state[DISPLACEMENT]) / lengths[i]
                state[DISPLACEMENT] = displacement
                reached += preisach.step(lab.learned, lab.learned_memory, displacement, way)
            force = specimen.force(tested, reached, lengths[i])
        before = after
    state[PLAYED] = before
    state[DISPLACEMENT] = displacement
    state[FORCE] = force
    return reached, force


@jit
def lagged(lab: ColumnLab, i: int, before: float, after: float, displacement: float) -> float:
    """Deformation of the specimen (m) behind the lag at the end of segment `i`, from that at its beginning.

    The command (m) moves from `before` to `after`. It updates the piston's place and speed.
    """
    row, limits, state, length = lab.rows[i], lab.limits, lab.state, lab.lengths[i]
    servo, rate, reaction = state[SERVO], state[SERVO_RATE], lab.specimen.cell[REACTION]
    free = second_order.step(row, second_order.OUTPUT, servo, rate, before, after)
    state[SERVO_RATE] = second_order.step(row, second_order.RATE, servo, rate, before, after)
    if limits[PRESENT] == 0.0:
        state[SERVO] = free
        return free
    middle, ahead = 0.5 * (before + after), free
    if limits[LOAD] > 0.0:
        ahead = under_load(row, limits, ahead, servo, reaction)
        pull = reaction + 0.5 * limits[STIFFNESS] * (ahead - servo)
        middle -= limits[LOAD] * pull / limits[GAIN]
    moved = limited(limits, ahead - servo, middle, servo, reaction, length)
    if moved != free - servo:
        state[SERVO_RATE] = moved / length
    state[SERVO] = servo + moved
    return loaded(limits, state, servo + moved, displacement, reaction, length)


@jit
def overlapped(limits: Array, state: Array, command: float) -> float:
    """Part of the command (m) that has no effect because of the overlap of a servo-hydraulic valve."""
    half = 0.5 * limits[DEADBAND]
    if half == 0.0:
        return 0.0
    piston = (
        state[STATES + servo_hydraulic.POSITION]
        + (limits[COMPLIANCE] + limits[LOAD]) * state[STATES + servo_hydraulic.FORCE]
    )
    error = limits[GAIN] * command - piston
    return blocked(limits, error) / limits[GAIN]


@jit
def blocked(limits: Array, error: float) -> float:
    """Part of an error of the loop (m) that the valve's overlap keeps from the flow."""
    half = 0.5 * limits[DEADBAND]
    if limits[LEAKING] != 0.0:
        return half * math.tanh(error / half)
    return (1.0 - limits[NULL_GAIN]) * min(max(error, -half), half)


@jit
def choked(limits: Array, state: Array) -> None:
    """Limit the flow of a servo-hydraulic valve to its largest value."""
    if limits[PRESENT] == 0.0:
        return
    flow = state[STATES + servo_hydraulic.FLOW]
    most = limits[VELOCITY_LIMIT] * pressure(limits, flow, state[STATES + servo_hydraulic.FORCE])
    if abs(flow) > most:
        state[STATES + servo_hydraulic.FLOW] = most if flow > 0.0 else -most
        state[STATES + servo_hydraulic.FLOW_RATE] = 0.0


@jit
def under_load(row: Array, limits: Array, ahead: float, servo: float, reaction: float) -> float:
    """Displacement of the piston (m) at a segment's end if the load within the loop moves it like a command of −c·f/K.

    `ahead` is that without load. The force is taken as `reaction + k·Δy`, linear over the segment, as in `loaded`.
    """
    moved = limits[LOAD] / limits[GAIN]
    stiff = moved * row[2] * limits[STIFFNESS]
    return float((ahead - moved * (row[1] + row[2]) * reaction + stiff * servo) / (1.0 + stiff))


@jit
def pressure(limits: Array, way: float, load: float) -> float:
    """Share of the highest speed that the load (N) leaves a valve in the direction of `way`: √(1 − f/stall)."""
    against = load if way > 0.0 else -load
    return math.sqrt(max(1.0 - against / limits[STALL], 0.0))


@jit
def limited(limits: Array, way: float, command: float, servo: float, load: float, length: float) -> float:
    """Displacement of the piston (m) within a segment of `length` s, from that of a valve without overlap or limit."""
    error = limits[GAIN] * command - servo
    if limits[DEADBAND] > 0.0:
        way *= (error - blocked(limits, error)) / error if error != 0.0 else 0.0
    if math.isinf(limits[VELOCITY_LIMIT]):
        return way
    longest = limits[VELOCITY_LIMIT] * length * pressure(limits, way, load)
    return saturated(way, longest, limits[SHARPNESS])


@jit
def loaded(
    limits: Array, state: Array, servo: float, displacement: float, reaction: float, length: float
) -> float:
    """Deformation (m) of the specimen where the piston gives way by `c·f` and the clevis has play.

    The force at the new deformation is taken as `reaction + k·Δδ` with the specimen's initial stiffness, which is exact
    for a linear specimen and late by one short step for a yielding one. Greased play is an implicit step of `length` s.
    """
    compliance, stiffness = limits[COMPLIANCE], limits[STIFFNESS]
    pushed = servo - compliance * (reaction - stiffness * displacement)
    stiffer = 1.0 + compliance * stiffness
    wanted = pushed / stiffer
    half = 0.5 * limits[BACKLASH] / stiffer
    if limits[SPRING_BACK] == 0.0 or half == 0.0:
        return min(max(displacement, wanted - half), wanted + half)
    slow = limits[SPRING_BACK] / length
    drawn = reaction / stiffness + wanted - displacement
    loose = min(max((slow * state[LOOSE] + drawn) / (slow * stiffer + 1.0), -half), half)
    state[LOOSE] = loose * stiffer
    return wanted - loose
