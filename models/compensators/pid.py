"""PID feedback beside a direct feedforward of the target.

`u = r + P·e + I·∫e dt + D·ė` with `e = r − y`: eq. (3) of Yokoyama et al. (17WCEE, 2020), with the
target itself fed forward, as their block diagram (fig. 9) has it. Not to be confused with a PID loop
without that feedforward, whose static gain on a unit-gain actuator is P/(1 + P).
"""

from __future__ import annotations

from typing import NamedTuple

from models.compiled import jit
from models.registry import Array

INTEGRAL, PREVIOUS_ERROR = 0, 1


class Params(NamedTuple):
    """Gains of the loop."""

    proportional: float  # P, –
    integral: float  # I, 1/s
    derivative: float  # D, s


@jit
def step(p: Array, s: Array, target: float, error: float, interval: float) -> float:
    """Command (m); the integral takes the trapezoid rule, the derivative the backward difference."""
    s[INTEGRAL] += 0.5 * interval * (s[PREVIOUS_ERROR] + error)
    slope = (error - s[PREVIOUS_ERROR]) / interval
    s[PREVIOUS_ERROR] = error
    return target + p[0] * error + p[1] * s[INTEGRAL] + p[2] * slope
