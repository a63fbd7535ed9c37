"""Checks of a record before parameters are identified from it."""

from __future__ import annotations

import math

import numpy as np

from common.errors import InputError
from models.registry import Array


def signals(least: int, **values: Array) -> list[Array]:
    """The named arrays as contiguous float64 vectors of one length, in the order given.

    Raises:
        InputError: one is no vector, too short, not finite, or of another length.
    """
    result = []
    size = -1
    for name, value in values.items():
        signal = np.ascontiguousarray(value, dtype=np.float64)
        if signal.ndim != 1:
            raise InputError(f"The {spoken(name)} has {signal.ndim} dimensions: give one value per tick.")
        if signal.size < least:
            raise InputError(
                f"The {spoken(name)} has {signal.size} samples, but at least {least} are needed: record longer."
            )
        if size not in (-1, signal.size):
            raise InputError(
                f"The {spoken(name)} has {signal.size} samples where {size} belong: give signals of one length."
            )
        bad = np.flatnonzero(~np.isfinite(signal))
        if bad.size:
            raise InputError(
                f"The {spoken(name)} is not finite at tick {bad[0]}: cut the record or repair the sensor."
            )
        size = signal.size
        result.append(signal)
    return result


def moves(name: str, signal: Array) -> None:
    """Raises InputError if the signal is constant."""
    if float(np.ptp(signal)) == 0.0:
        raise InputError(f"The {spoken(name)} is constant: nothing can be identified without excitation.")


def positive(name: str, value: float) -> None:
    """Raises InputError if the number is not finite or not above zero."""
    if not math.isfinite(value) or value <= 0.0:
        raise InputError(f"The {spoken(name)} is {value:g}, but must be above 0.")


def spoken(name: str) -> str:
    """An argument's name as words."""
    return name.replace("_", " ")
