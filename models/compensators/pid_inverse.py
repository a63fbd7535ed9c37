"""PID feedback in parallel with the fixed inverse of the actuator.

`u = Σ c_j·r^(j) + P·e + I·∫e dt + D·ė` (m), the coefficients `c_j` being those of `inverse` and the gains
those of `pid`: feedforward and feedback of Phillips and Spencer (NSEL report 29, 2012), with a PID in the
place of their regulator. The error left by an inexact inverse is divided by about 1 + P. Not to be confused
with `pid_taylor`, whose feedforward takes the lag for a dead time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from models.compensators import inverse, pid
from models.compensators.wanted import Wanted
from models.compiled import jit
from models.registry import Array


class PidInverseParams(NamedTuple):
    """Gains of the loop and the actuator inverted; the gains stand first, as `pid` reads them."""

    proportional: float  # P, –
    integral: float  # I, 1/s
    derivative: float  # D, s
    delay: float  # L, s
    time_constant: float  # T, s
    gain: float = 1.0  # K, –
    order: float = 2.0  # 1, 2 or 3


RULES = {**pid.RULES, **inverse.RULES}


def pack(params: Array, _interval: float) -> Array:
    """Parameters followed by the coefficients of the inverse."""
    return np.concatenate([params, inverse.coefficients(*params[3:].tolist())])


@jit
def step(p: Array, s: Array, wanted: Wanted, interval: float) -> float:
    """Command (m)."""
    return pid.around(p, s, inverse.series(p, 7, wanted), wanted, interval)
