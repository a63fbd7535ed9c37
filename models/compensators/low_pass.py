"""Butterworth low-pass of a compensator that learns: the same filter for commands and measurements."""

from __future__ import annotations

import numpy as np

from common.errors import InputError
from models.compiled import jit
from models.registry import Array


def coefficients(kind: str, order: int, cutoff: float, interval: float) -> Array:
    """Sections of an even `order` with corner `cutoff` (Hz), b0 b1 b2 a1 a2 each; then the memory at a constant 1.

    Raises:
        InputError: the corner is above what the interval (s) resolves; `kind` is the compensator it names.
    """
    most = 0.5 / interval
    if cutoff >= most:
        raise InputError(f"cutoff of compensator '{kind}' is {cutoff:g}, but must be below {most:g} Hz.")
    from scipy import signal  # half a second and 50 MB that only these compensators need

    sections = signal.butter(order, cutoff, fs=1.0 / interval, output="sos")
    rest = signal.sosfilt_zi(sections)
    return np.concatenate([sections[:, [0, 1, 2, 4, 5]].ravel(), rest.ravel()])


@jit
def settle(p: Array, first: int, sections: int, s: Array, at: int, value: float) -> None:
    """Set a filter to its steady state at a constant input.

    Its memory begins at place `at` of `s`, and its `sections` sections at place `first` of `p`.
    """
    for i in range(2 * sections):
        s[at + i] = p[first + 5 * sections + i] * value


@jit
def step(p: Array, first: int, sections: int, s: Array, at: int, value: float) -> float:
    """The output of that filter for the next input, in direct form II transposed."""
    for i in range(sections):
        b = first + 5 * i
        z = at + 2 * i
        out = p[b] * value + s[z]
        s[z] = p[b + 1] * value - p[b + 3] * out + s[z + 1]
        s[z + 1] = p[b + 2] * value - p[b + 4] * out
        value = out
    return value
