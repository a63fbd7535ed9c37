"""Linear specimen `f = k·δ`."""

from __future__ import annotations

from typing import NamedTuple

from models.compiled import jit
from models.registry import Array


class Params(NamedTuple):
    """Its stiffness."""

    stiffness: float  # N/m


STATE_SIZE = 0


@jit
def step(p: Array, deformation: float) -> float:
    """Force (N) at a deformation (m)."""
    return p[0] * deformation
