"""The state that all integrators share: one row per quantity, one column per storey."""

from __future__ import annotations

import numpy as np

from models.registry import Array

DISPLACEMENT, VELOCITY, ACCELERATION = 0, 1, 2  # at the present tick
NEXT_DISPLACEMENT = 3  # at the next tick, known before its forces are measured
NEXT_VELOCITY = 4  # at the next tick, as far as it is known without its forces
MEMORY = 5  # first of the rows that belong to the method
ROWS = 8


def rest(storeys: int) -> Array:
    """State of a building at rest; shape (ROWS, storeys)."""
    return np.zeros((ROWS, storeys))
