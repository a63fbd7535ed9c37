"""A value that does not exceed a level: suddenly, or bending there.

    x/(1 + |x/L|ⁿ)^(1/n)

With the sharpness n → ∞ it is clipped at the level L.
"""

from __future__ import annotations

import math

import numpy as np

from models.compiled import jit


@jit
def saturated(value: float, level: float, sharpness: float) -> float:
    """The value behind the saturation, in its unit; `sharpness` ≥ 1 may be infinite. No power of it overflows."""
    if math.isinf(level):
        return value
    if math.isinf(sharpness):
        return float(min(max(value, -level), level))
    share = abs(value) / level
    if share <= 1.0:
        return float(value / (1.0 + share**sharpness) ** (1.0 / sharpness))
    return float(np.copysign(level * (1.0 + share ** (-sharpness)) ** (-1.0 / sharpness), value))
