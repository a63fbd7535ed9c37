"""What table and damper do between two ticks, as a filter shows that sees more than the ticks, or a delay by a part."""

from __future__ import annotations

import math

import numpy as np

from common.recording.logger.passing import later
from laboratories.table import motor
from models.registry import Array
from models.system import System


def motor_at_ticks(system: System, command: Array) -> tuple[Array, Array]:
    """What is asked of the motor (ticks,) N within its limit, and its states at the ticks (3, ticks)."""
    effects, lag = system.effects.damper, system.plan.damper.motor_time_constant
    wanted = np.clip(effects.gain * command, -effects.force_limit, effects.force_limit)
    return wanted, motor.states(wanted, system.plan.test.interval, lag, effects.motor_damping)


def motor_bend(system: System, command: Array, place: float | None = None) -> Array:
    """Means of the motor's force around each tick, less those of a smooth curve through the ticks, (ticks,) N.

    With a `place` from 0 at a tick to 1 at the next one it is what the force itself has there, less such a curve.

    `command` (ticks,) N is held until the next tick. After its step the force of a motor of first order changes fast
    and then slowly. What it has beyond a straight line is the mean of that in the two intervals beside a tick; a smooth
    curve lies below the line by second differences. The limit of the force is taken to be sharp.
    """
    lag, damping = system.plan.damper.motor_time_constant, system.effects.damper.motor_damping
    interval = system.plan.test.interval
    wanted, states = motor_at_ticks(system, command)
    at = 0.5 if place is None else place
    along = (1.0 - at) * states[motor.FORCE, :-1] + at * states[motor.FORCE, 1:]
    inside = wanted[:-1] if at > 0.0 else states[motor.FORCE, :-1]  # of a motor that follows at once
    if lag > 0.0 and place is None:
        inside = motor.within(interval, lag, damping)[motor.INTEGRAL, :-1] / interval @ states[:, :-1]
    elif lag > 0.0:
        inside = motor.within(at * interval, lag, damping)[motor.FORCE, :-1] @ states[:, :-1]
    beyond = inside - along
    smooth = 1.0 / 12.0 if place is None else 0.5 * place * (1.0 - place)
    result = np.zeros(command.size)
    result[1:-1] = 0.5 * (beyond[:-1] + beyond[1:]) + smooth * np.diff(states[motor.FORCE], 2)
    return result


def corners(system: System, command: Array) -> tuple[float, float, Array]:
    """The table's frequency (rad/s), its dead time (ticks), and the second differences of its command (ticks,) m."""
    table = system.plan.table
    steps = np.zeros(command.size)
    steps[1:-1] = np.diff(system.effects.table.gain * command, 2)
    return 2.0 * math.pi * table.frequency, table.delay / system.plan.test.interval, steps


def acceleration_bend(system: System, command: Array, place: float | None = None) -> Array:
    """Means of the table's acceleration around each tick, less those of lines between ticks, (ticks,) m/s².

    With a `place` from 0 at a tick to 1 at the next one it is what the acceleration itself has there, less such lines.

    `command` (ticks,) m goes in straight lines from tick to tick. Where these meet, φ of an interval Δ behind a tick as
    the dead time has it, the rate of the acceleration of a loop of second order steps by ω²·ü·Δ, and between them it
    falls by as much: arcs of a height ω²·ü·Δ²/8, whose mean is ω²·ü·Δ²·(1/12 − φ·(1 − φ)/2) above their ticks.
    """
    if math.isinf(system.plan.table.frequency):
        return np.zeros(command.size)
    omega, ticks, steps = corners(system, command)
    between = ticks % 1.0
    inside = 0.0 if place is None else (place - between) % 1.0
    height = 1.0 / 12.0 if place is None else 0.5 * inside * (1.0 - inside)
    return omega**2 * (height - 0.5 * between * (1.0 - between)) * later(steps, 1.0 + ticks)
