"""PID feedback beside a direct feedforward of the target.

`u = r + P·e + I·∫e dt + D·ė` with `e = r − y` (m): eq. (3) of Yokoyama et al. (17WCEE, 2020), with the
target itself fed forward, as their block diagram (fig. 9) has it. Not to be confused with a PID loop
without that feedforward, whose static gain on a unit-gain actuator is P/(1 + P).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.plan.schema import Rule
from models.compensators.wanted import Wanted
from models.compiled import jit
from models.registry import Array

INTEGRAL, PREVIOUS_ERROR = 0, 1


class PidParams(NamedTuple):
    """Gains of the loop."""

    proportional: float  # P, –
    integral: float  # I, 1/s
    derivative: float  # D, s


RULES = {
    "proportional": Rule("gain on the error", least=0.0),
    "integral": Rule("gain on the error's integral", "1/s", least=0.0),
    "derivative": Rule("gain on the error's rate", "s", least=0.0),
}


def state(_params: Array, _interval: float) -> Array:
    """Integral of the error (m·s) and the last error (m), at rest."""
    return np.zeros(2)


@jit
def around(p: Array, s: Array, ahead: float, wanted: Wanted, interval: float) -> float:
    """Command (m) around what is fed forward; the integral by the trapezoid rule, the derivative backward."""
    error = wanted.present - wanted.measured
    s[INTEGRAL] += 0.5 * interval * (s[PREVIOUS_ERROR] + error)
    slope = (error - s[PREVIOUS_ERROR]) / interval
    s[PREVIOUS_ERROR] = error
    return ahead + p[0] * error + p[1] * s[INTEGRAL] + p[2] * slope


@jit
def step(p: Array, s: Array, wanted: Wanted, interval: float) -> float:
    """Command (m) around the target."""
    return around(p, s, wanted.target, wanted, interval)
