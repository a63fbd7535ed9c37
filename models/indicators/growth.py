"""Whether a free motion decays or grows."""

from __future__ import annotations

import numpy as np

from models.registry import Array

PARTS = 4  # equal parts of the motion, of which the last two are compared
GROWN = (
    1.02  # least ratio of the last two rms values that counts as growth; rounding and beats stay below 2 %
)
GONE = 1e-6  # of the largest rms value: a motion below it counts as decayed to rounding


def grows(motion: Array) -> bool:
    """Whether a free motion (n,) or any of several (n, columns) grows towards its end, or is not finite.

    The root mean square of its last quarter is compared with that of the quarter before.
    """
    columns = motion.reshape(motion.shape[0], -1)
    if not np.all(np.isfinite(columns)):
        return True
    largest = np.max(np.abs(columns), axis=0)
    scaled = columns / np.where(largest > 0.0, largest, 1.0)
    size = scaled.shape[0] // PARTS
    rms = [np.sqrt(np.mean(scaled[part * size : (part + 1) * size] ** 2, axis=0)) for part in range(PARTS)]
    there = rms[-1] > GONE * np.max(rms, axis=0)
    return bool(np.any(there & (rms[-1] > GROWN * rms[-2])))
