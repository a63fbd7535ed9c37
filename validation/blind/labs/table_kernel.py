"""Laboratory B in short steps: table loop, platform, damper and motor; classical Runge-Kutta.

ÿ = ω²·(u(t − L) + c·F − y) − 2ζω·ẏ,    F = k·s + c·ṡ + rail − u_m
m·(s̈ + ÿ) = −F,                          T_m·u̇_m + u_m = command
"""

from __future__ import annotations

from typing import NamedTuple

from validation.blind.labs.parts import delay, filters, friction, mechanics
from validation.blind.labs.parts.compiled import Array, jit
from validation.blind.labs.unlisted import damper as unlisted_damper
from validation.blind.labs.unlisted import table as unlisted_table
from validation.blind.labs.unlisted.effect import EffectMemory

# m/s; the mass moves at up to some 0.5 m/s, so that friction is Coulomb's but near a reversal.
RUBBING = 1e-3  # scale of the regularised friction, of rail and table
STICKING = 5e-3  # scale of the rail's Stribeck effect
# m, deflection of the rail's contact before it slides: tens of micrometres in rolling guides.
PRESLIDING = 20e-6
# S, damping of the bristles over Coulomb friction, times their presliding: damped within a fraction of an interval.
MICRO = 0.5e-3
PITCH_DAMPING = 0.05  # ratio of bolted steel parts
QUICKEST = (
    3e-4  # s, lag below which a loop of second order is taken as one of first order: steps must follow it
)
CURRENT_DAMPING = 0.7  # ratio of a current loop of second order: usual tuning

# places in `state`: table loop, stroke, motor, platform, pitch, appendage; each with its rate
LOOP, LOOP_RATE, STROKE, STROKE_RATE, MOTOR, PLATE, PLATE_RATE = range(7)
PITCH, PITCH_RATE, LOOSE, LOOSE_RATE, CURRENT, CURRENT_RATE = range(7, 13)
MOVING = 13
COMMAND, BRISTLE = 13, 14  # no states of the equations of motion
STATE = 15
DISPLACEMENT, ACCELERATION, STROKE_OUT, FORCE = range(4)  # places of the readings


class TableMemory(NamedTuple):
    """State of the laboratory, which `advance` moves on."""

    state: Array
    past: Array  # commands within the dead time
    approximation: Array  # of a dead time that is approximated
    work: Array  # (6, MOVING): rates, and room for the readings
    filtered: Array  # of the readings
    between: Array  # (steps, 4): readings at the ends of the steps of the last interval
    unlisted: EffectMemory


class TrueTable(NamedTuple):
    """True parameters of table and damper; zero means that the effect is absent."""

    step: float  # s
    steps: float  # of an interval
    omega: float  # rad/s
    damping: float  # ratio
    delay: float  # s
    mass: float  # kg
    stiffness: float  # N/m
    dashpot: float  # N·s/m
    motor_lag: float  # s
    pade: float = 0.0  # s, dead time that is approximated
    table_gain: float = 1.0
    oil: float = 0.0  # rad/s
    oil_damping: float = 0.1
    compliance: float = 0.0  # m/N
    play: float = 0.0  # m
    table_friction: float = 0.0  # m/s²
    cam: float = 0.0  # m
    cam_period: float = 0.02  # m
    pitch: float = 0.0  # coupling
    pitch_omega: float = 100.0  # rad/s
    motor_more: float = 0.0  # s, in addition to that lag
    motor_order: float = 1.0  # 2 for a loop of second order behind that lag
    motor_gain: float = 1.0
    force_limit: float = 0.0  # N
    rubbing: float = 0.0  # formula
    friction: float = 0.0  # N
    stopping: float = 0.0  # formula
    stop_stroke: float = 1.0  # m
    stop_stiffness: float = 0.0  # N/m
    drag: float = 0.0  # N·s²/m²
    motor_rise: float = 0.0
    cubic: float = 0.0  # N/m³
    appendage: float = 0.0  # kg
    appendage_omega: float = 10.0  # rad/s
    appendage_damping: float = 0.1  # ratio
    unlisted: float = 0.0  # code of an effect of no catalogue, of the table or the damper


@jit
def rail(p: TrueTable, x: Array, bristle: float) -> float:
    """Force (N) of guide rail, cable, spring and stops between mass and table."""
    s, w = x[STROKE], x[STROKE_RATE]
    result = p.stiffness * s + p.dashpot * w + p.cubic * s**3 + p.drag * w * abs(w)
    if p.friction > 0.0:
        scale = RUBBING if p.rubbing == friction.TANH else STICKING
        result += p.friction * friction.share(p.rubbing, bristle, w, PRESLIDING, scale, MICRO)
    return float(result + mechanics.stop(p.stopping, s, w, p.stop_stroke, p.stop_stiffness))


@jit
def asked(p: TrueTable, command: float) -> float:
    """Steady force (N) of the motor under a command."""
    wanted = p.motor_gain * command
    return mechanics.saturated(wanted, p.force_limit) if p.force_limit > 0.0 else wanted


@jit
def swings(p: TrueTable) -> bool:
    """Whether the motor has a loop of second order."""
    return p.motor_order > 1.0 and p.motor_more > QUICKEST


@jit
def first_lag(p: TrueTable) -> float:
    """Time constant (s) of the motor's lag of first order."""
    return p.motor_lag if swings(p) else max(p.motor_lag + p.motor_more, 0.0)


@jit
def pushed(p: TrueTable, x: Array, push: float) -> float:
    """Force (N) of the motor at a state; `push` is what is asked of it."""
    if swings(p):
        return float(x[CURRENT])
    return float(x[MOTOR]) if first_lag(p) > 0.0 else push


@jit
def damper_force(p: TrueTable, x: Array, added: Array, push: float, start: float, bristle: float) -> float:
    """Force (N) on the table at a state; `start` is the stroke to which the bristles' deflection belongs."""
    motor = pushed(p, x, push)
    motor *= mechanics.motor_constant(p.motor_rise, x[STROKE])
    motor += added[unlisted_table.MOTOR]
    if p.friction > 0.0:
        bristle = bent(p, bristle, x[STROKE] - start, x[STROKE_RATE])
    return float(rail(p, x, bristle) + added[unlisted_table.RAIL] - motor)


@jit
def bent(p: TrueTable, bristle: float, moved: float, velocity: float) -> float:
    """Deflection of the rail's bristles after a move."""
    return friction.after(p.rubbing, bristle, moved, velocity, PRESLIDING, STICKING)


@jit
def platform(p: TrueTable, x: Array, loop: float) -> float:
    """Acceleration (m/s²) of the platform; without oil spring or backlash that of the loop."""
    if p.oil > 0.0:
        return mechanics.oil_column(p.oil, p.oil_damping, x[LOOP], x[PLATE], x[PLATE_RATE])
    if p.play > 0.0:
        return mechanics.played(p.play, x[LOOP], x[LOOP_RATE], x[PLATE], x[PLATE_RATE])
    return loop


@jit
def rates(
    p: TrueTable,
    x: Array,
    dx: Array,
    added: Array,
    wanted: float,
    push: float,
    start: float,
    bristle: float,
) -> None:
    """Rates `dx` of the state under a table command (m) and the force asked of the motor (N)."""
    force = damper_force(p, x, added, push, start, bristle)
    wanted += added[unlisted_table.DEMAND]
    loop = p.omega**2 * (wanted + p.compliance * force - x[LOOP]) - 2.0 * p.damping * p.omega * x[LOOP_RATE]
    if p.table_friction > 0.0:
        loop -= p.table_friction * friction.regularised(x[LOOP_RATE], RUBBING)
    loop += added[unlisted_table.KICK]
    plate = platform(p, x, loop)
    loose = p.appendage_omega**2 * x[LOOSE]
    loose += 2.0 * p.appendage_damping * p.appendage_omega * x[LOOSE_RATE]
    mass = (p.appendage * loose - force) / p.mass  # absolute acceleration of the damper
    dx[LOOP], dx[LOOP_RATE] = x[LOOP_RATE], loop
    dx[PLATE], dx[PLATE_RATE] = (x[PLATE_RATE], plate) if p.oil + p.play > 0.0 else (x[LOOP_RATE], loop)
    dx[STROKE], dx[STROKE_RATE] = x[STROKE_RATE], mass - plate
    lag = first_lag(p)
    dx[MOTOR] = (push - x[MOTOR]) / lag if lag > 0.0 else 0.0
    if swings(p):
        quick = (2.0 * CURRENT_DAMPING / p.motor_more) ** 2
        before = x[MOTOR] if lag > 0.0 else push
        dx[CURRENT] = x[CURRENT_RATE]
        dx[CURRENT_RATE] = quick * (before - x[CURRENT] - p.motor_more * x[CURRENT_RATE])
    dx[PITCH] = x[PITCH_RATE]
    dx[PITCH_RATE] = (
        -p.pitch * plate - 2.0 * PITCH_DAMPING * p.pitch_omega * x[PITCH_RATE] - p.pitch_omega**2 * x[PITCH]
    )
    dx[LOOSE], dx[LOOSE_RATE] = x[LOOSE_RATE], -loose - mass


@jit
def move(
    p: TrueTable,
    state: Array,
    work: Array,
    added: Array,
    early: float,
    middle: float,
    late: float,
    push: float,
) -> None:
    """One step of the state under a table command at its beginning, middle and end."""
    h, start, bristle = p.step, state[STROKE], state[BRISTLE]
    rates(p, state, work[0], added, early, push, start, bristle)
    for i in range(MOVING):
        work[4, i] = state[i] + 0.5 * h * work[0, i]
    rates(p, work[4], work[1], added, middle, push, start, bristle)
    for i in range(MOVING):
        work[4, i] = state[i] + 0.5 * h * work[1, i]
    rates(p, work[4], work[2], added, middle, push, start, bristle)
    for i in range(MOVING):
        work[4, i] = state[i] + h * work[2, i]
    rates(p, work[4], work[3], added, late, push, start, bristle)
    for i in range(MOVING):
        state[i] += h * (work[0, i] + 2.0 * work[1, i] + 2.0 * work[2, i] + work[3, i]) / 6.0
    if p.friction > 0.0:
        state[BRISTLE] = bent(p, bristle, state[STROKE] - start, state[STROKE_RATE])


@jit
def observe(
    p: TrueTable, state: Array, work: Array, added: Array, out: Array, wanted: float, push: float
) -> None:
    """Write the true values at the sensors into `out`."""
    rates(p, state, work[0], added, wanted, push, state[STROKE], state[BRISTLE])
    out[DISPLACEMENT] = state[PLATE]
    out[ACCELERATION] = work[0, PLATE_RATE] + work[0, PITCH_RATE]
    out[STROKE_OUT] = state[STROKE]
    out[FORCE] = damper_force(p, state, added, push, state[STROKE], state[BRISTLE])


@jit
def look(p: TrueTable, state: Array, rate: Array, held: EffectMemory, wanted: float, push: float) -> None:
    """Let the effect of no catalogue see the state and its `rate` at the end of a step."""
    seen = held.seen
    seen[unlisted_table.TIME] += p.step
    seen[unlisted_table.STEP] = p.step
    seen[unlisted_table.WANTED] = wanted
    seen[unlisted_table.PLACE] = state[PLATE]
    seen[unlisted_table.RATE] = state[PLATE_RATE]
    seen[unlisted_table.SPRING] = p.omega**2
    seen[unlisted_table.DASHPOT] = 2.0 * p.damping * p.omega
    seen[unlisted_table.ACCELERATION] = rate[PLATE_RATE]
    seen[unlisted_table.STROKE] = state[STROKE]
    seen[unlisted_table.STROKE_RATE] = state[STROKE_RATE]
    seen[unlisted_table.STROKE_ACC] = rate[STROKE_RATE]
    seen[unlisted_table.PUSH] = pushed(p, state, push)
    unlisted_table.hold(p.unlisted, held.sizes, held.kept, seen, held.added)
    unlisted_damper.hold(p.unlisted, held.sizes, held.kept, seen, held.added)


@jit
def told(p: TrueTable, value: float) -> float:
    """Command (m) of the table's loop behind its calibration and its screw."""
    value *= p.table_gain
    return mechanics.cam(value, p.cam, p.cam_period) if p.cam > 0.0 else value


@jit
def advance(
    p: TrueTable,
    lags: Array,
    memory: TableMemory,
    command: float,
    motor_command: float,
) -> tuple[float, float, float, float]:
    """Table m and m/s², stroke m and force N behind their filters one interval later.

    The table's command is ramped, the motor's is held.
    """
    state, past, approximation = memory.state, memory.past, memory.approximation
    work, filtered, added = memory.work, memory.filtered, memory.unlisted.added
    begun, back, steps = state[COMMAND], p.delay / p.step, int(p.steps)
    push = asked(p, motor_command)
    out = work[5]
    raw = delay.pade_output(approximation, p.pade) if p.pade > 0.0 else delay.before(past, back)
    late = told(p, raw)
    for i in range(steps):
        delay.push(past, begun + (command - begun) * (i + 1) / steps)
        before, raw, early = raw, delay.before(past, back), late
        middle = delay.before(past, back + 0.5)
        if p.pade > 0.0:
            raw = delay.pade(approximation, p.pade, raw, p.step)
            middle = 0.5 * (before + raw)
        late = told(p, raw)
        move(p, state, work, added, early, told(p, middle), late, push)
        observe(p, state, work, added, out, late, push)
        if p.unlisted > 0.0:
            look(p, state, work[0], memory.unlisted, late, push)
        for k in range(4):
            out[k] = filters.step_filter(lags[k], filtered[k], out[k], p.step)
            memory.between[i, k] = out[k]
    state[COMMAND] = command
    return out[DISPLACEMENT], out[ACCELERATION], out[STROKE_OUT], out[FORCE]
