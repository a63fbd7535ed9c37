"""Bilinear hysteresis with kinematic hardening.

An elastic-perfectly plastic element of stiffness (1 − α)·k in parallel with an elastic one of α·k: the
plastic deformation follows so that the first never exceeds (1 − α)·k·δ_y (Simo and Hughes,
Computational Inelasticity, section 1.2.2; the return mapping is exact in one dimension).
"""

from __future__ import annotations

from typing import NamedTuple

from models.compiled import jit
from models.registry import Array

PLASTIC = 0  # place of the plastic deformation in the memory


class Params(NamedTuple):
    """Its elastic branch and its yield point."""

    stiffness: float  # k, N/m
    yield_displacement: float  # δ_y, m
    hardening: float  # α, stiffness after yielding over before, –


@jit
def step(p: Array, s: Array, i: int, deformation: float) -> float:
    """Force (N) at a deformation (m) of the column described in row `i`, whose memory moves on."""
    elastic = deformation - s[i, PLASTIC]
    if elastic > p[i, 1]:
        s[i, PLASTIC] += elastic - p[i, 1]
    elif elastic < -p[i, 1]:
        s[i, PLASTIC] += elastic + p[i, 1]
    return p[i, 2] * p[i, 0] * deformation + (1.0 - p[i, 2]) * p[i, 0] * (deformation - s[i, PLASTIC])
