"""Linear elastic specimen: `f = k·δ`."""

from __future__ import annotations

from typing import NamedTuple

from common.plan.schema import Rule
from models.compiled import jit
from models.registry import Array


class LinearParams(NamedTuple):
    """Parameters, in the order of the kernel's array."""

    stiffness: float  # N/m


RULES = {"stiffness": Rule("elastic stiffness", "N/m", least=0.0)}
STATE_SIZE = 0
STIFFNESS = 0


@jit
def step(p: Array, s: Array, deformation: float) -> float:
    """Force (N) at a deformation (m); the state `s` is not used."""
    stiffness: float = p[STIFFNESS]
    return stiffness * deformation
