"""Series in the form in which a report holds them: the strongest seconds, few points, few digits."""

from __future__ import annotations

import numpy as np

from models.registry import Array

# s, length of a history: about ten periods of a building of 2 Hz, in which single cycles can still be seen.
SHOWN = 6.0
POINTS = 1500  # of a series at most: two to a pixel of a picture on the page


def strongest(series: Array, interval: float) -> slice:
    """The `SHOWN` seconds in which a series has most energy, thinned to at most about `POINTS` samples."""
    length = min(series.size, max(2, round(SHOWN / interval)))
    energy = np.cumsum(np.append(0.0, series**2))
    start = int(np.argmax(energy[length:] - energy[:-length]))
    return slice(start, start + length, max(1, length // POINTS))


def numbers(values: Array) -> tuple[float, ...]:
    """Values rounded to five digits, which is finer than a curve on a page shows."""
    return tuple(float(f"{value:.5g}") for value in values)
