"""Dead time: a ring of past values on a fine grid, or a rational approximation.

The ring is an array whose first element is the place of the newest value; values lie one step apart.
"""

from __future__ import annotations

import math

import numpy as np

from validation.blind.labs.parts.compiled import Array, jit
from validation.blind.labs.parts.filters import second_order

PADE, PADE_RATE, PADE_INPUT = range(3)  # places in the approximation's state
# s, two steps: a shorter approximation is faster than the grid, and the ring takes the delay.
SHORTEST = 0.2e-3


def ring(delay: float, step: float) -> Array:
    """A ring at rest, long enough for `delay` s."""
    return np.concatenate([[1.0], np.zeros(math.ceil(delay / step) + 4)])


@jit
def push(past: Array, value: float) -> None:
    """Store the newest value."""
    place = int(past[0]) + 1
    if place >= past.size:
        place = 1
    past[0] = place
    past[place] = value


@jit
def before(past: Array, steps: float) -> float:
    """The value a number of steps ago, interpolated linearly between stored values."""
    whole = int(steps)
    share = steps - whole
    later = int(past[0]) - whole
    if later < 1:
        later += past.size - 1
    earlier = later - 1
    if earlier < 1:
        earlier += past.size - 1
    return float((1.0 - share) * past[later] + share * past[earlier])


@jit
def pade_output(state: Array, delay: float) -> float:
    """Present output of the approximation."""
    return float(state[PADE_INPUT] - delay * state[PADE_RATE])


@jit
def pade(state: Array, delay: float, value: float, step: float) -> float:
    """Second-order Padé approximation of a delay, one step on.

        e^(−ds) ≈ (1 − ds/2 + d²s²/12)/(1 + ds/2 + d²s²/12)

    G. A. Baker, P. Graves-Morris, Padé Approximants, Cambridge University Press 1996.
    """
    state[PADE], state[PADE_RATE] = second_order(
        math.sqrt(12.0) / delay, 6.0 / delay, state[PADE], state[PADE_RATE], state[PADE_INPUT], value, step
    )
    state[PADE_INPUT] = value
    return pade_output(state, delay)
