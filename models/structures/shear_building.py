"""Shear building."""

from __future__ import annotations

import numpy as np

from models.compiled import jit
from models.registry import Array


def matrices(mass: Array, stiffness: Array, damping: Array) -> tuple[Array, Array, Array]:
    """M, C, K."""
    def tri(k):
        n=k.size; out=np.zeros((n,n))
        for i in range(n):
            out[i,i]+=k[i]
            if i>0:
                out[i-1,i-1]+=k[i]; out[i,i-1]-=k[i]; out[i-1,i]-=k[i]
        return out
    return np.diag(mass), tri(damping), tri(stiffness)


@jit
def storey_drift(x: Array, i: int) -> float:
    """Drift of storey i."""
    if i == 0:
        return x[0]
    return x[i] - x[i - 1]


@jit
def add_nodal(storey_force: float, i: int, out: Array) -> None:
    """Add."""
    out[i] += storey_force
    if i > 0:
        out[i - 1] -= storey_force
