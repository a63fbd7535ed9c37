"""Rows of an integrator's state `s`, shape (ROWS, n): one column per degree of freedom.

The rows from MEMORY on are each method's own.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from models.registry import Array

Floats = NDArray[np.floating[Any]]

DISPLACEMENT, VELOCITY, ACCELERATION = range(3)  # at the present tick t_k: m, m/s, m/s²
NEXT_DISPLACEMENT = 3  # x_{k+1}, m, known before the force at it is measured
NEXT_VELOCITY = 4  # explicit estimate of v(t_{k+1}), m/s
MEMORY = 5
ROWS = 8


def begin(x0: Array, v0: Array, a0: Floats) -> Array:
    """State before the first step: the motion (n,) of t_0 in present and next rows, memory left at zero."""
    s = np.zeros((ROWS, x0.size))
    s[[DISPLACEMENT, NEXT_DISPLACEMENT]] = x0
    s[[VELOCITY, NEXT_VELOCITY]] = v0
    s[ACCELERATION] = a0
    return s


def stack(*matrices: Floats) -> Array:
    """Matrices (n, n) as the coefficients (m, n, n) of a kernel, C-contiguous."""
    return np.ascontiguousarray(np.stack(matrices), dtype=np.float64)
