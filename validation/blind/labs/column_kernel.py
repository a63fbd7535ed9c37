"""Laboratory A in short steps: servo loop of first order, clevis, column; classical Runge-Kutta.

T·ẏ = K·u(t − L) − y
"""

from __future__ import annotations

import math
from typing import NamedTuple

from validation.blind.labs.parts import delay, filters, specimen, valve
from validation.blind.labs.parts.compiled import Array, jit
from validation.blind.labs.parts.specimen import TrueSpecimen
from validation.blind.labs.unlisted import actuator as unlisted_actuator
from validation.blind.labs.unlisted import column as unlisted_column
from validation.blind.labs.unlisted.effect import EffectMemory

CONTACT = 1e4  # stiffness of the clevis over the specimen's: it takes 0.01 % of the motion, less than the sensor sees
GREASE = 5e-3  # s, dashpot of the clevis over the specimen's stiffness: the specimen returns through the gap in 5 ms

# places in `state`
COMMAND, PISTON, SPOOL, USED, TIME, DEFORMATION, FORCE, READING, VALVE, ASKED = range(10)
STATE = 10


class Servo(NamedTuple):
    """True parameters of the actuator; zero means that the effect is absent."""

    step: float  # s
    steps: float  # of an interval
    gain: float
    delay: float  # s
    time_constant: float  # s
    slower: float = 1.0  # times the time constant: how late the loop is
    slow_valve: float = 0.0  # 1 where what it is later than planned is a lag of the valve before it
    pade: float = 0.0  # s, dead time that is approximated
    limiting: float = 0.0  # formula
    velocity_limit: float = 1.0  # m/s
    backlash: float = 0.0  # m
    compliance: float = 0.0  # m/N
    deadband: float = 0.0  # m
    hysteresis: float = 0.0  # m
    droop: float = 0.0  # share of the flow gain
    ripple: float = 0.0  # m
    ripple_frequency: float = 10.0  # Hz
    unlisted: float = 0.0  # code of an effect of no catalogue, of the actuator or the column


class ColumnMemory(NamedTuple):
    """State of the laboratory, which `advance` moves on."""

    state: Array
    past: Array  # commands within the dead time
    approximation: Array  # of a dead time that is approximated
    specimen: Array
    filtered: Array  # of the readings
    between: Array  # (steps, 2): readings at the ends of the steps of the last interval
    unlisted: EffectMemory


@jit
def loop_lag(p: Servo) -> float:
    """Time constant (s) of the servo loop."""
    return p.time_constant if valve_lag(p) > 0.0 else p.slower * p.time_constant


@jit
def valve_lag(p: Servo) -> float:
    """Time constant (s) of a valve before the loop, 0 for one that follows at once."""
    return (p.slower - 1.0) * p.time_constant if p.slow_valve > 0.0 and p.slower > 1.0 else 0.0


@jit
def opened(p: Servo, state: Array, wanted: float) -> float:
    """The command (m) behind the valve a step later, for one that goes straight to `wanted` m; updates its state."""
    slow = p.step / valve_lag(p)
    kept = math.exp(-slow)
    now = 1.0 + math.expm1(-slow) / slow
    state[VALVE] = kept * state[VALVE] + (1.0 - kept - now) * state[ASKED] + now * wanted
    state[ASKED] = wanted
    return float(state[VALVE])


@jit
def velocity(
    p: Servo, stiffness: float, state: Array, added: Array, wanted: float, piston: float, time: float
) -> float:
    """Velocity (m/s) of the piston at `piston` m under the command `wanted` m.

    The load follows the specimen's first stiffness within a step. It takes the place of an error of the
    loop where the oil column yields: `T·ẏ = K·u − y − c·f` (Merritt, Hydraulic Control Systems, Wiley 1967).
    """
    load = state[FORCE] + stiffness * (piston - state[PISTON])
    error = p.gain * wanted + added[unlisted_actuator.DEMAND] - piston - p.compliance * load
    error = valve.spool(state[SPOOL], error, p.hysteresis)
    free = valve.overlap(error, p.deadband) / loop_lag(p)
    free *= valve.supplied(p.droop, state[USED])
    if p.ripple != 0.0:
        omega = 2.0 * math.pi * p.ripple_frequency
        free += p.ripple * omega * math.cos(omega * time)
    free += added[unlisted_actuator.SPEED] * free + added[unlisted_actuator.FLOW]
    return valve.flow(p.limiting, free, p.velocity_limit, load)


@jit
def drive(
    p: Servo, stiffness: float, state: Array, added: Array, early: float, middle: float, late: float
) -> float:
    """Place of the piston (m) one step later under a command at its beginning, middle and end."""
    h, y, t = p.step, state[PISTON], state[TIME]
    a = velocity(p, stiffness, state, added, early, y, t)
    b = velocity(p, stiffness, state, added, middle, y + 0.5 * h * a, t + 0.5 * h)
    c = velocity(p, stiffness, state, added, middle, y + 0.5 * h * b, t + 0.5 * h)
    d = velocity(p, stiffness, state, added, late, y + h * c, t + h)
    moved = h * (a + 2.0 * b + 2.0 * c + d) / 6.0
    error = p.gain * late - (y + moved) - p.compliance * (state[FORCE] + stiffness * moved)
    state[SPOOL] = valve.spool(state[SPOOL], error, p.hysteresis)
    state[USED] = (state[USED] + abs(moved)) / (1.0 + h / valve.REFILL)
    state[TIME] = t + h
    return float(y + moved)


@jit
def clevis(p: Servo, stiffness: float, state: Array, piston: float) -> float:
    """Deformation (m) of the specimen behind a spring with a dead zone and a dashpot, by implicit Euler.

        c·(ẏ − δ̇) + k_c·dead(y − δ, ±w/2) = f(δ)

    M. Nordin, P.-O. Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002)
    1633-1649 (dead zone with a damped spring).
    """
    rate = stiffness * GREASE / p.step
    contact = CONTACT * stiffness
    half = 0.5 * p.backlash
    before = state[PISTON] - state[DEFORMATION]
    # with x = y − δ: rate·(x − before) + contact·dead(x) = force + stiffness·(y − x − δ)
    push = rate * before + state[FORCE] + stiffness * (piston - state[DEFORMATION])
    x = push / (rate + stiffness)
    if abs(x) > half:
        x = (push + math.copysign(contact * half, x)) / (rate + stiffness + contact)
    return float(piston - x)


@jit
def look(
    p: Servo,
    column: TrueSpecimen,
    state: Array,
    held: EffectMemory,
    wanted: float,
    piston: float,
    place: float,
) -> None:
    """Let the effect of no catalogue see the end of a step at `piston` and deformation `place`, both m."""
    seen, h = held.seen, p.step
    rate = (place - state[DEFORMATION]) / h
    seen[unlisted_actuator.TIME] = state[TIME]
    seen[unlisted_actuator.STEP] = h
    seen[unlisted_actuator.PISTON] = piston
    seen[unlisted_actuator.PISTON_RATE] = (piston - state[PISTON]) / h
    seen[unlisted_actuator.ERROR] = p.gain * wanted - piston
    seen[unlisted_actuator.ACCELERATION] = (rate - seen[unlisted_actuator.RATE]) / h
    seen[unlisted_actuator.RATE] = rate
    seen[unlisted_actuator.PLACE] = place
    seen[unlisted_actuator.FORCE] = state[FORCE]
    seen[unlisted_actuator.STIFFNESS] = column.stiffness
    unlisted_actuator.hold(p.unlisted, held.sizes, held.kept, seen, held.added)
    unlisted_column.hold(p.unlisted, held.sizes, held.kept, seen, held.added)


@jit
def advance(
    p: Servo,
    column: TrueSpecimen,
    lags: Array,
    memory: ColumnMemory,
    command: float,
) -> tuple[float, float]:
    """Displacement (m) and force (N) behind their filters one interval later, the command ramped."""
    state, past, approximation, filtered = memory.state, memory.past, memory.approximation, memory.filtered
    held, added, between = memory.unlisted, memory.unlisted.added, memory.between
    start = state[COMMAND]
    back = p.delay / p.step
    displacement, force = 0.0, 0.0
    steps = int(p.steps)
    late = delay.before(past, back)
    if p.pade > 0.0:
        late = delay.pade_output(approximation, p.pade)
    for i in range(steps):
        delay.push(past, start + (command - start) * (i + 1) / steps)
        early, late = late, delay.before(past, back)
        middle = delay.before(past, back + 0.5)
        if p.pade > 0.0:
            late = delay.pade(approximation, p.pade, late, p.step)
            middle = 0.5 * (early + late)
        if valve_lag(p) > 0.0:
            early, late = state[VALVE], opened(p, state, late)
            middle = 0.5 * (early + late)
        piston = drive(p, column.stiffness, state, added, early, middle, late)
        deformation = clevis(p, column.stiffness, state, piston) if p.backlash > 0.0 else piston
        deformation += added[unlisted_actuator.SHIFT]
        state[FORCE], state[READING] = specimen.force(column, memory.specimen, deformation, p.step)
        state[FORCE] += added[unlisted_actuator.LOAD]
        state[READING] += added[unlisted_actuator.LOAD]
        if p.unlisted > 0.0:
            look(p, column, state, held, late, piston, deformation)
        state[PISTON], state[DEFORMATION] = piston, deformation
        displacement = filters.step_filter(lags[0], filtered[0], deformation, p.step)
        force = filters.step_filter(lags[1], filtered[1], state[READING], p.step)
        between[i, 0], between[i, 1] = displacement, force
    state[COMMAND] = command
    return displacement, force
