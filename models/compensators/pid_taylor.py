"""PID feedback in parallel with a first-order Taylor prediction: the compensator of the seed paper.

`u = r + τ·ṙ + P·e + I·∫e dt + D·ė`: eqs. (3) and (6) and fig. 9 of Yokoyama et al. (17WCEE, 2020). On a
lag T with dead time L it leaves about `(L + T − τ)/(1 + P)` of delay at low frequency.
"""

from __future__ import annotations

from typing import NamedTuple

from models.compensators import pid
from models.compiled import jit
from models.registry import Array


class Params(NamedTuple):
    """Gains of the loop and the lead of the feedforward; the gains stand first, as `pid` reads them."""

    proportional: float  # P, –
    integral: float  # I, 1/s
    derivative: float  # D, s
    lead: float  # τ, s


@jit
def step(p: Array, s: Array, target: float, rate: float, error: float, interval: float) -> float:
    """Command (m)."""
    return pid.step(p, s, target + p[3] * rate, error, interval)
