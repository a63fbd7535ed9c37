"""Series as a report holds them: their units, their strongest seconds, few points of few digits."""

from __future__ import annotations

import numpy as np

from models.registry import Array

SHOWN = 6.0  # s of a history
POINTS = 1500  # of a series at most


def strongest(series: Array, interval: float) -> slice:
    """The few seconds in which a series is largest."""
    length = min(series.size, max(2, round(SHOWN / interval)))
    energy = np.cumsum(np.append(0.0, series**2))
    start = int(np.argmax(energy[length:] - energy[:-length]))
    return slice(start, start + length, max(1, length // POINTS))


def numbers(values: Array) -> tuple[float, ...]:
    """Values of five digits each."""
    return tuple(float(f"{value:.5g}") for value in values)
