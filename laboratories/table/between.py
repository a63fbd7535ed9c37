"""What table and damper do between two ticks, as a filter shows that sees more than the ticks, or a delay by a part."""

from __future__ import annotations

import math

import numpy as np

from common.recording.imported import later
from models.registry import Array
from models.system import System


def motor_bend(system: System, command: Array, place: float | None = None) -> Array:
    """Means of the motor's force around each tick, less those of straight lines between ticks, (ticks,) N.

    With a `place` from 0 at a tick to 1 at the next one it is what the force itself has there, less such lines.

    `command` (ticks,) N is held until the next tick. After its step the force u(t) = F + (u₀ − F)·e^(−t/T) changes
    fast and then slowly; over an interval Δ its mean lies 1/(1 − e^(−a)) − 1/a − 1/2 of its change above that of a
    straight line, with a = Δ/T, and at the place p it has made (1 − e^(−a·p))/(1 − e^(−a)) of its change. The limit of
    the force is taken to be sharp.
    """
    from scipy import signal

    effects, lag = system.effects.damper, system.plan.damper.motor_time_constant
    wanted = np.clip(effects.gain * command, -effects.force_limit, effects.force_limit)
    steps = system.plan.test.interval / lag if lag > 0.0 else math.inf
    share = -math.expm1(-steps)
    force = signal.lfilter([0.0, share], [1.0, share - 1.0], wanted)
    result = np.zeros(command.size)
    above = 1.0 / share - 1.0 / steps - 0.5
    if place is not None:
        above = -math.expm1(-place * steps) / share - place if place > 0.0 else 0.0
    result[1:-1] = above * 0.5 * (force[2:] - force[:-2])
    return result


def acceleration_bend(system: System, command: Array, place: float | None = None) -> Array:
    """Means of the table's acceleration around each tick, less those of lines between ticks, (ticks,) m/s².

    With a `place` from 0 at a tick to 1 at the next one it is what the acceleration itself has there, less such lines.

    `command` (ticks,) m goes in straight lines from tick to tick. Where these meet, φ of an interval Δ behind a tick as
    the dead time has it, the rate of the acceleration of a loop of second order steps by ω²·ü·Δ, and between them it
    falls by as much: arcs of a height ω²·ü·Δ²/8, whose mean is ω²·ü·Δ²·(1/12 − φ·(1 − φ)/2) above their ticks.
    """
    table, interval = system.plan.table, system.plan.test.interval
    if math.isinf(table.frequency):
        return np.zeros(command.size)
    omega, ticks = 2.0 * math.pi * table.frequency, table.delay / interval
    between = ticks % 1.0
    steps = np.zeros(command.size)
    steps[1:-1] = np.diff(system.effects.table.gain * command, 2)
    inside = 0.0 if place is None else (place - between) % 1.0
    height = 1.0 / 12.0 if place is None else 0.5 * inside * (1.0 - inside)
    return omega**2 * (height - 0.5 * between * (1.0 - between)) * later(steps, 1.0 + ticks)
