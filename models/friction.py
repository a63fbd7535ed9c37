"""How large a friction is at a speed: `F·tanh(|v|/v₀)·(1 − d·(1 − exp(−|v|/v_s)))`.

Below v₀ it falls off, which makes the law smooth; beyond, a moving contact may rub less than a slow one, or more with
d < 0. B. Armstrong-Hélouvry, P. Dupont and C. Canudas de Wit, Automatica 30 (1994), 1083-1138, section 2.
"""

from __future__ import annotations

import numpy as np

from models.compiled import jit

COULOMB = 1e-6  # m/s, up to which v₀ stands for no falling off at all


@jit
def left(rate: float, velocity: float, drop: float, speed: float) -> float:
    """Share of a friction that is left at a rate (m/s): v₀ = `velocity` and v_s = `speed` in m/s, d = `drop`."""
    size = abs(rate)
    share = 1.0 if velocity <= COULOMB else np.tanh(size / velocity)
    if drop != 0.0:
        share *= 1.0 - drop * (1.0 - np.exp(-size / speed))
    return float(share)
