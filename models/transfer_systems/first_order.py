"""First-order lag `T·ẏ + y = K·u`, propagated exactly over segments of a straight-line input.

The nominal hydraulic actuator, with the dead time of `delay.py` in front: eq. (1) of Yokoyama et al.
(17WCEE, 2020).
"""

from __future__ import annotations

import math

import numpy as np

from models.compiled import jit
from models.registry import Array


def propagators(gain: float, time_constant: float, lengths: Array) -> Array:
    """Rows (a, b0, b1) of `y1 = a·y0 + b0·u0 + b1·u1` for each segment; shape (m, 3).

    With q = h/T: a = e^(−q), b1 = K·(1 − (1 − a)/q), b0 = K·(1 − a) − b1. T = 0 gives y1 = K·u1.
    """
    rows = []
    for length in lengths:
        if time_constant == 0.0:
            rows.append((0.0, 0.0, gain))
            continue
        q = float(length) / time_constant
        fade = math.exp(-q)
        late = gain * (1.0 + math.expm1(-q) / q)
        rows.append((fade, -gain * math.expm1(-q) - late, late))
    return np.array(rows)


@jit
def step(row: Array, output: float, before: float, after: float) -> float:
    """Output at a segment's end from its value and the input at the beginning, and the input at the end."""
    return row[0] * output + row[1] * before + row[2] * after
