"""PID feedback in parallel with a Taylor prediction: with order 1 the compensator of the seed paper.

`u = r + τ·ṙ + … + P·e + I·∫e dt + D·ė` (m): eqs. (3) and (6) and fig. 9 of Yokoyama et al. (17WCEE, 2020).
On a lag T with dead time L it leaves about `(L + T − τ)/(1 + P)` of delay at low frequency. Not to be
confused with a PID loop whose reference is the prediction: here the error is that of the target itself.
"""

from __future__ import annotations

from typing import NamedTuple

from models.compensators import pid, taylor
from models.compensators.wanted import Wanted
from models.compiled import jit
from models.registry import Array


class PidTaylorParams(NamedTuple):
    """Gains of the loop and the lead of the feedforward; the gains stand first, as `pid` reads them."""

    proportional: float  # P, –
    integral: float  # I, 1/s
    derivative: float  # D, s
    lead: float  # τ, s
    order: float = 1.0  # 1, 2 or 3


RULES = {**pid.RULES, **taylor.RULES}


@jit
def step(p: Array, s: Array, wanted: Wanted, interval: float) -> float:
    """Command (m)."""
    return pid.around(p, s, taylor.predict(p[3], p[4], wanted), wanted, interval)
