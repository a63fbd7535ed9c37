"""The reading of a value: `saturated(gain·delayed(passed(lagged(value)))) + bias + drift·t + noise`, rounded.

The lag is `τ·ẏ + y = x`, or `(τ/2ζ)²·ÿ + τ·ẏ + y = x` with a damping ratio ζ, and the high-pass is
`τ·ẏ + y = τ·ẋ`; `saturated(x) = x/(1 + |x/L|ⁿ)^(1/n)`, with
the level L. Values are linear between ticks, for both and for a delay by any part of an interval, and zero before the
first tick. Without effects a reading equals exactly value plus noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from models.compiled import jit
from models.registry import Array
from models.saturation import saturated
from models.system import SensorEffects
from models.transfer_systems import second_order

PRESENT, GAIN, BIAS, DRIFT, QUANTUM, DELAY, LEVEL, SHARPNESS, FORGETS, PASSES = range(10)
LAG = 10  # first column of the lag's propagation, as in `models.transfer_systems.second_order`
# from KEPT on a ring of the values kept for a delay; NEWEST is its newest place
LAGGED, LAGGED_RATE, PREVIOUS, PASSED, NEWEST, KEPT = range(6)


class Readings(NamedTuple):
    """One laboratory's sensors with their memory, which `step` updates."""

    params: Array  # (signals, 18)
    state: Array  # (signals, 5 and as many as the longest delay needs)


def build(interval: float, names: Sequence[str], sensors: Mapping[str, SensorEffects]) -> Readings:
    """Sensors at rest, one row per name."""
    params = np.zeros((len(names), LAG + second_order.COLUMNS))
    for place, name in enumerate(names):
        more = sensors.get(name, SensorEffects())
        if more == SensorEffects():
            continue
        steady = (more.gain, more.bias, more.drift, more.quantization)
        level = more.saturation if math.isfinite(more.saturation) else 0.0
        passing = high_pass(interval, more.high_pass)
        bent = (level, more.saturation_sharpness)
        lagging = second_order.propagators(1.0, more.lag, more.lag_damping, np.array([interval]))[0]
        params[place] = (1.0, *steady, more.delay / interval, *bent, *passing, *lagging)
    longest = float(np.max(params[:, DELAY], initial=0.0))
    return Readings(params, np.zeros((len(names), KEPT + (int(longest) + 2 if longest > 0.0 else 0))))


def high_pass(interval: float, time_constant: float) -> tuple[float, float]:
    """Share of a high-pass's output that an interval takes away, and share of a change of its input that it passes.

    For inputs that are linear over the interval; both in s, the time constant infinite without a high-pass.
    """
    forgets = -math.expm1(-interval / time_constant)
    return forgets, forgets * time_constant / interval if forgets else 1.0


def levels(names: Sequence[str], nominal: Array, sensors: Mapping[str, SensorEffects]) -> Array:
    """Noise (rms) of each reading: the plan's, and the noise that an effect adds to it."""
    more = np.array([sensors.get(name, SensorEffects()).noise for name in names])
    return np.where(more > 0.0, np.hypot(nominal, more), nominal)


@jit
def delayed(sensors: Readings, place: int, value: float) -> float:
    """The value of signal `place` before its delay; updates the ring by one tick."""
    params, state = sensors.params, sensors.state
    ticks = params[place, DELAY]
    if ticks == 0.0:
        return value
    size = state.shape[1] - KEPT
    newest = (int(state[place, NEWEST]) + 1) % size
    state[place, NEWEST] = newest
    state[place, KEPT + newest] = value
    whole = int(ticks)
    rest = ticks - whole
    late = state[place, KEPT + (newest - whole) % size]
    later = state[place, KEPT + (newest - whole - 1) % size]
    return (1.0 - rest) * late + rest * later


@jit
def step(sensors: Readings, place: int, value: float, noise: float, t: float) -> float:
    """The reading of signal `place` at time `t` (s); updates its state by one tick."""
    params, state = sensors.params, sensors.state
    if params[place, PRESENT] == 0.0:
        return value + noise
    lagging, before, rate = params[place, LAG:], state[place, PREVIOUS], state[place, LAGGED_RATE]
    lagged = second_order.step(lagging, second_order.OUTPUT, state[place, LAGGED], rate, before, value)
    rate = second_order.step(lagging, second_order.RATE, state[place, LAGGED], rate, before, value)
    state[place, LAGGED_RATE] = rate
    passed = lagged
    if params[place, FORGETS] > 0.0:
        change = params[place, PASSES] * (lagged - state[place, LAGGED])
        passed = (1.0 - params[place, FORGETS]) * state[place, PASSED] + change
        state[place, PASSED] = passed
    state[place, LAGGED] = lagged
    state[place, PREVIOUS] = value
    read = params[place, GAIN] * delayed(sensors, place, passed)
    if params[place, LEVEL] > 0.0:
        read = saturated(read, params[place, LEVEL], params[place, SHARPNESS])
    result = read + params[place, BIAS] + params[place, DRIFT] * t + noise
    quantum = params[place, QUANTUM]
    if quantum > 0.0:
        result = quantum * np.floor(result / quantum + 0.5)
    return result
