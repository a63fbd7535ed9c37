"""What a sensor makes of a value: `gain·lagged(value) + bias + drift·t + noise`, rounded to its step.

The lag is of first order, `τ·ẏ + y = x`, for a value that moves on a straight line from tick to tick.
Without effects a reading is value plus noise to the last bit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from models.compiled import jit
from models.registry import Array
from models.system import SensorEffects
from models.transfer_systems import first_order

PRESENT, GAIN, BIAS, DRIFT, QUANTUM, FADE, EARLY, LATE = range(8)
LAGGED, PREVIOUS = range(2)


class Readings(NamedTuple):
    """Arrays of one laboratory's sensors, in the order `step` takes them."""

    params: Array  # (signals, 8)
    state: Array  # (signals, 2)


def build(interval: float, names: Sequence[str], sensors: Mapping[str, SensorEffects]) -> Readings:
    """Sensors at rest, one row per name."""
    params = np.zeros((len(names), 8))
    for place, name in enumerate(names):
        more = sensors.get(name, SensorEffects())
        row = first_order.propagators(1.0, more.lag, np.array([interval]))[0]
        steady = (more.gain, more.bias, more.drift, more.quantization)
        params[place] = (float(more != SensorEffects()), *steady, *row)
    return Readings(params, np.zeros((len(names), 2)))


def levels(names: Sequence[str], nominal: Array, sensors: Mapping[str, SensorEffects]) -> Array:
    """Rms noise of each reading: the plan's, and what an effect adds to it."""
    more = np.array([sensors.get(name, SensorEffects()).noise for name in names])
    return np.where(more > 0.0, np.hypot(nominal, more), nominal)


@jit
def step(params: Array, state: Array, place: int, value: float, noise: float, t: float) -> float:
    """Reading of signal `place` at time `t` s; its state moves on by one tick."""
    if params[place, PRESENT] == 0.0:
        return value + noise
    lagged = (
        params[place, FADE] * state[place, LAGGED]
        + params[place, EARLY] * state[place, PREVIOUS]
        + params[place, LATE] * value
    )
    state[place, LAGGED] = lagged
    state[place, PREVIOUS] = value
    result = params[place, GAIN] * lagged + params[place, BIAS] + params[place, DRIFT] * t + noise
    quantum = params[place, QUANTUM]
    if quantum > 0.0:
        result = quantum * np.floor(result / quantum + 0.5)
    return result
