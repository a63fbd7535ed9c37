"""What the damper's motor does between two ticks, as only a filter shows that sees more than the ticks."""

from __future__ import annotations

import math

import numpy as np

from models.registry import Array
from models.system import System


def bend(system: System, command: Array) -> Array:
    """Means of the motor's force around each tick, less those of straight lines between ticks, (ticks,) N.

    `command` (ticks,) N is held until the next tick. After its step the force u(t) = F + (u₀ − F)·e^(−t/T) changes
    fast and then slowly; over an interval Δ its mean lies 1/(1 − e^(−a)) − 1/a − 1/2 of its change above that of a
    straight line, with a = Δ/T. A sharp end of the motor's force is taken, whatever its bend.
    """
    from scipy import signal

    effects, lag = system.effects.damper, system.plan.damper.motor_time_constant
    wanted = np.clip(effects.gain * command, -effects.force_limit, effects.force_limit)
    steps = system.plan.test.interval / lag if lag > 0.0 else math.inf
    share = -math.expm1(-steps)
    force = signal.lfilter([0.0, share], [1.0, share - 1.0], wanted)
    result = np.zeros(command.size)
    result[1:-1] = (1.0 / share - 1.0 / steps - 0.5) * 0.5 * (force[2:] - force[:-2])
    return result
