"""Low-pass filters of the readings, by the trapezoidal rule on the fine grid."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from validation.blind.labs.parts.compiled import Array, jit

ORDER, TIME = range(2)  # places in a filter: 0, 1 or 2; s
OUTPUT, RATE, INPUT = range(3)  # places in its state


def bank(names: Sequence[str], lags: Mapping[str, tuple[float, float]]) -> Array:
    """One filter per reading; `lags` gives order and low-frequency delay (s) by reading."""
    return np.array([lags.get(name, (0.0, 0.0)) for name in names], dtype=np.float64)


@jit
def second_order(
    omega: float, damping: float, y: float, rate: float, early: float, late: float, step: float
) -> tuple[float, float]:
    """Output and its rate of `ÿ + damping·ẏ + ω²·y = ω²·x`, x on a straight line over the step."""
    half = 0.5 * step
    square = omega * omega
    push = square * (early - y) - damping * rate + square * (late - y - half * rate)
    after = (rate + half * push) / (1.0 + half * damping + half * half * square)
    return y + half * (rate + after), after


@jit
def step_filter(kind: Array, state: Array, value: float, step: float) -> float:
    """Reading behind its filter, one step on.

        first order:   τ·ẏ + y = x
        Butterworth:   ÿ + √2·ω·ẏ + ω²·y = ω²·x,  ω = √2/τ, so that slow signals lag by τ, too

    S. Butterworth, On the theory of filter amplifiers, Experimental Wireless 7 (1930) 536-541.
    """
    if kind[ORDER] == 0.0 or kind[TIME] <= 0.0:
        return value
    if kind[ORDER] == 1.0:
        share = 0.5 * step / kind[TIME]
        state[OUTPUT] = ((1.0 - share) * state[OUTPUT] + share * (state[INPUT] + value)) / (1.0 + share)
    else:
        omega = math.sqrt(2.0) / kind[TIME]
        state[OUTPUT], state[RATE] = second_order(
            omega, math.sqrt(2.0) * omega, state[OUTPUT], state[RATE], state[INPUT], value, step
        )
    state[INPUT] = value
    return float(state[OUTPUT])
