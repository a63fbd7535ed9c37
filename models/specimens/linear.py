"""Linear elastic column `f = k·δ`."""

from __future__ import annotations

from typing import NamedTuple

from models.compiled import jit
from models.registry import Array


class Params(NamedTuple):
    """Its stiffness."""

    stiffness: float  # N/m


@jit
def step(p: Array, i: int, deformation: float) -> float:
    """Force (N) at a deformation (m) of the column described in row `i`."""
    return p[i, 0] * deformation
