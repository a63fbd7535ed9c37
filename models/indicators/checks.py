"""The checks of signals that all indicators share."""

from __future__ import annotations

import numpy as np

from common.errors import InputError
from models.registry import Array


def checked(**signals: Array) -> None:
    """Raise InputError where signals are empty, of unequal length, or not finite."""
    sizes = {name: values.size for name, values in signals.items()}
    for name, values in signals.items():
        if values.ndim != 1 or values.size == 0:
            raise InputError(f"{name} has the shape {values.shape}: give one value per tick.")
        if not np.all(np.isfinite(values)):
            raise InputError(f"{name} holds numbers that are not finite.")
    if len(set(sizes.values())) > 1:
        lengths = ", ".join(f"{name} {size}" for name, size in sizes.items())
        raise InputError(f"Signals differ in length: {lengths}.")


def moving(**signals: Array) -> None:
    """Raise InputError where a signal never changes."""
    for name, values in signals.items():
        if float(np.ptp(values)) == 0.0:
            raise InputError(f"{name} is constant: nothing can be said of how it is followed.")
