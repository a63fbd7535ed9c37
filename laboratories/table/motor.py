"""The motor of an active mass damper under a command that is held from tick to tick."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from models.registry import Array

FORCE, RATE, COMMAND, INTEGRAL = range(4)


@lru_cache(maxsize=256)
def within(length: float, time_constant: float, damping: float) -> Array:
    """Propagation (4, 4) of a motor's force, its rate, its command and the force's integral, over a length (s).

    With a damping ratio ζ it is one of second order, (T/2ζ)²·ü + T·u̇ + u = F, of first order if that is infinite. The
    time constant T (s) is above zero, and the rate of a motor of first order is left zero.
    """
    from scipy import linalg

    rates = np.zeros((4, 4))
    rates[INTEGRAL, FORCE] = 1.0
    if math.isinf(damping):
        rates[FORCE, [FORCE, COMMAND]] = -1.0 / time_constant, 1.0 / time_constant
        rates[RATE, RATE] = -1.0 / time_constant  # so that what rounding leaves there fades
    else:
        omega = 2.0 * damping / time_constant
        rates[FORCE, RATE] = 1.0
        rates[RATE, [FORCE, RATE, COMMAND]] = -(omega**2), -2.0 * damping * omega, omega**2
    result = np.asarray(linalg.expm(rates * length))
    result.flags.writeable = False  # the next caller gets the same one
    return result


def states(command: Array, interval: float, time_constant: float, damping: float) -> Array:
    """Force (N), rate (N/s) and command (N) of a motor at each tick, (3, ticks), at rest at the first one.

    `command` (ticks,) N is held for an interval (s) from its tick on. See `within` for the other arguments.
    """
    if time_constant == 0.0:
        held = np.concatenate([[0.0], command[:-1]])
        return np.stack([held, np.zeros_like(held), command])
    from scipy import signal

    above, below = transfer(interval, time_constant, damping)
    force, rate = (signal.lfilter(row, below, command) for row in above)
    return np.stack([force, rate, command])


@lru_cache(maxsize=256)
def transfer(interval: float, time_constant: float, damping: float) -> tuple[Array, Array]:
    """Numerators (2, 3) of force and rate from tick to tick over the command, and their denominator (3,)."""
    from scipy import signal

    step = within(interval, time_constant, damping)
    own, driven = step[:COMMAND, :COMMAND], step[:COMMAND, COMMAND:INTEGRAL]
    above, below = signal.ss2tf(own, driven, np.eye(COMMAND), np.zeros((COMMAND, 1)))
    return np.asarray(above), np.asarray(below)
