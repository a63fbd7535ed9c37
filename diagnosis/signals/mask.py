"""Which samples count."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]  # one value per sample


def longest(known: Mask) -> slice:
    """The longest stretch of ticks (ticks,) at which something is known."""
    ends = np.flatnonzero(np.diff(np.r_[False, known, False].astype(int)))
    begins, behind = ends[::2], ends[1::2]
    if not begins.size:
        return slice(0)
    place = int(np.argmax(behind - begins))
    return slice(int(begins[place]), int(behind[place]))
