"""High-pass correction of the measured force: its phase lead compensates the remaining delay.

    H(s) = √(1 + (ω_c/ω_0)²)·s/(s + ω_c)

At ω_0 the gain is one and the lead `atan(ω_c/ω_0)/ω_0`. The idea is that of the seed paper's journal
version, Frontiers in Built Environment 6:145 (2020), doi 10.3389/fbuil.2020.00145; the normalisation to a
gain of one at the structure's frequency is a choice made here. Discretised by the trapezoid rule.

It removes a constant force, so it suits specimens that vibrate about zero, not one that yields to one side.
"""

from __future__ import annotations

import math

from common.plan.laboratory_tables import ForceCorrection
from models.compiled import jit
from models.registry import Array

MEASURED, CORRECTED = range(2)


def coefficients(correction: ForceCorrection, interval: float) -> tuple[float, float]:
    """The filter's memory (–) and gain (–) at an interval (s); (1, 0) where there is no correction."""
    if correction.cutoff == 0.0:
        return 1.0, 0.0
    half = math.pi * correction.cutoff * interval
    gain = math.hypot(1.0, correction.cutoff / correction.unity) / (1.0 + half)
    return (1.0 - half) / (1.0 + half), gain


@jit
def step(memory: float, gain: float, s: Array, force: float) -> float:
    """Corrected force (N) of a tick; `s` begins with what was measured and corrected at the tick before."""
    if gain == 0.0:
        return force
    corrected = memory * s[CORRECTED] + gain * (force - s[MEASURED])
    s[MEASURED] = force
    s[CORRECTED] = corrected
    return corrected
