"""PI feedback on the error of a target led by a phase-lead filter.

    e = L(r) − y,   u = P·e + I·∫e dt,   L(s) = gain·(s + zero)/(s + pole)

with target `r` and measurement `y` of the same tick: the sample controller of the benchmark control problem
(Silva, Gomez, Maghareh, Dyke and Spencer, Mechanical Systems and Signal Processing 135, 2020), whose numbers the
defaults are. Both transfer functions take Tustin's rule at the control interval. Not to be confused with `pid`,
which adds a direct feedforward of the target.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.plan.schema import Rule
from models.compensators.wanted import Wanted
from models.compiled import jit
from models.registry import Array


class PiLeadParams(NamedTuple):
    """Gains of the loop, and the lead filter before its summing junction."""

    proportional: float = 2.0  # P, –
    integral: float = 95.0  # I, 1/s
    lead_gain: float = 50.8  # –
    lead_zero: float = 168.6  # rad/s
    lead_pole: float = 8570.0  # rad/s


RULES = {
    "proportional": Rule("gain on the error", least=0.0),
    "integral": Rule("gain on the error's integral", "1/s", least=0.0),
    "lead_gain": Rule("gain of the lead filter at high frequency", above=0.0),
    "lead_zero": Rule("zero of the lead filter", "rad/s", above=0.0),
    "lead_pole": Rule("pole of the lead filter", "rad/s", above=0.0),
}
LEAD_GAIN, LEAD_ZERO, LEAD_POLE = 2, 3, 4
NOW, BEFORE, KEPT = 5, 6, 7  # led(k) = NOW·r(k) + BEFORE·r(k−1) + KEPT·led(k−1)
PREVIOUS_TARGET, LED, INTEGRAL, PREVIOUS_ERROR = range(4)


def pack(params: Array, interval: float) -> Array:
    """Parameters followed by the coefficients of the lead filter."""
    half = 0.5 * interval
    zero, pole = half * params[LEAD_ZERO], half * params[LEAD_POLE]
    gain = params[LEAD_GAIN] / (1.0 + pole)
    return np.concatenate([params, [gain * (1.0 + zero), gain * (zero - 1.0), (1.0 - pole) / (1.0 + pole)]])


def state(_params: Array, _interval: float) -> Array:
    """Last target (m), last led target (m), integral of the error (m·s) and last error (m), at rest."""
    return np.zeros(4)


@jit
def step(p: Array, s: Array, wanted: Wanted, interval: float) -> float:
    """Command (m) from target and measurement of one instant."""
    s[LED] = p[NOW] * wanted.present + p[BEFORE] * s[PREVIOUS_TARGET] + p[KEPT] * s[LED]
    s[PREVIOUS_TARGET] = wanted.present
    error = s[LED] - wanted.measured
    s[INTEGRAL] += 0.5 * interval * (s[PREVIOUS_ERROR] + error)
    s[PREVIOUS_ERROR] = error
    return p[0] * error + p[1] * s[INTEGRAL]
