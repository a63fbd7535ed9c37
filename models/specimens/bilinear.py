"""Elastoplastic specimen with linear kinematic hardening.

The force is that of a spring `α·k` beside a spring `(1 − α)·k` in series with a slider of Coulomb type:

    f = α·k·δ + (1 − α)·k·z,    z = z₀ + Δδ clipped to ±δ_y

Return mapping in one dimension, exact for any monotonic increment: Simo and Hughes, Computational
Inelasticity (1998), chapter 1. The slider's elastic range is 2·δ_y wide and moves with the hardening line
(Masing); a cycle of amplitude X > δ_y dissipates `4·(1 − α)·k·δ_y·(X − δ_y)`.

Not to be confused with isotropic hardening, where the elastic range grows, nor with Clough's or Takeda's
models, whose unloading and reloading stiffness degrades as that of cracked concrete does.
"""

from __future__ import annotations

from typing import NamedTuple

from common.plan.schema import Rule
from models.compiled import jit
from models.registry import Array


class BilinearParams(NamedTuple):
    """Parameters, in the order of the kernel's array."""

    stiffness: float  # k, N/m
    yield_displacement: float  # δ_y, m
    hardening: float = 0.0  # α, stiffness after yielding over elastic stiffness


RULES = {
    "stiffness": Rule("elastic stiffness", "N/m", least=0.0),
    "yield_displacement": Rule("deformation at first yield", "m", above=0.0),
    "hardening": Rule("stiffness after yielding over elastic stiffness", above=-1.0, most=1.0),
}
STIFFNESS, YIELD_DISPLACEMENT, HARDENING = range(3)

DEFORMATION, ELASTIC = range(2)  # δ and z of the last call, m
STATE_SIZE = 2


@jit
def step(p: Array, s: Array, deformation: float) -> float:
    """Force (N) at a deformation (m) reached from that of the last call; `s` (2,) moves on."""
    limit = p[YIELD_DISPLACEMENT]
    elastic = min(max(s[ELASTIC] + deformation - s[DEFORMATION], -limit), limit)
    s[DEFORMATION] = deformation
    s[ELASTIC] = elastic
    force: float = p[STIFFNESS] * (p[HARDENING] * deformation + (1.0 - p[HARDENING]) * elastic)
    return force
