"""Lag of second order `(T/2ζ)²·ÿ + T·ẏ + y = K·u`, propagated exactly over segments of a straight-line input.

It is as late as a lag of first order, `first_order`, for slow inputs: a servo loop, a current loop, or an amplifier.
"""

from __future__ import annotations

import math

import numpy as np

from models.compiled import jit
from models.registry import Array
from models.transfer_systems import first_order

# first columns of the rows for the output and for its rate, and how many there are
OUTPUT, RATE, COLUMNS = 0, 4, 8


def propagators(gain: float, time_constant: float, damping: float, lengths: Array) -> Array:
    """Rows (a, b0, b1, c, a', b0', b1', c') for each segment of a length (s); shape (m, 8).

    y1 = a·y0 + b0·u0 + b1·u1 + c·ẏ0, and the rate ẏ1 likewise by the last four. With an infinite damping ratio ζ or no
    time constant T (s) the lag is of first order, and what concerns the rate is zero. By one matrix exponential with
    the input as further states (Van Loan 1978).
    """
    rows = np.zeros((len(lengths), COLUMNS))
    if math.isinf(damping) or time_constant == 0.0:
        rows[:, :3] = first_order.propagators(gain, time_constant, lengths)
        return rows
    from scipy.linalg import expm

    omega = 2.0 * damping / time_constant
    for row, length in zip(rows, lengths.tolist(), strict=True):
        rates = np.zeros((4, 4))  # of output, its rate, input, and the input's rate
        rates[0, 1] = rates[2, 3] = 1.0
        rates[1, :3] = -(omega**2), -2.0 * damping * omega, gain * omega**2
        moved = expm(rates * length)[:2]
        late = moved[:, 3] / length
        row[:] = np.stack([moved[:, 0], moved[:, 2] - late, late, moved[:, 1]], axis=1).ravel()
    return rows


@jit
def step(row: Array, place: int, output: float, rate: float, before: float, after: float) -> float:
    """Output (place `OUTPUT`) or its rate (place `RATE`) at a segment's end.

    From both at its beginning, and from the input at the beginning and at the end.
    """
    lagged = row[place] * output + row[place + 1] * before + row[place + 2] * after
    return float(lagged + row[place + 3] * rate)
