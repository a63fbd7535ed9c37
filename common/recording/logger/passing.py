"""High-pass filters, means over time and delays of a data logger."""

from __future__ import annotations

import math

import numpy as np

from common.recording.logger.low_pass import Samples

NODES = (-2, -1, 0, 1)  # ticks of the samples around one, through which a cubic goes


def past_high_pass(values: Samples, interval: float, corner: float) -> Samples:
    """A signal (ticks,) after a high-pass of first order with a corner in Hz, linear between ticks.

    The signal stood at its first value before, which the amplifier had forgotten.
    """
    from scipy import signal

    step = 2.0 * math.pi * corner * interval
    kept = math.exp(-step)
    change = np.diff(values, prepend=values[0])
    return np.asarray(signal.lfilter([-math.expm1(-step) / step], [1.0, -kept], change))


def averaged(values: Samples, interval: float, length: float, means: int = 1) -> Samples:
    """Means of a signal (ticks,) over the last `length` s, smooth between ticks and constant before the first one.

    They are means of means, so many times. A twelfth of the second differences gives back what straight lines between
    ticks would take away.
    """
    for _ in range(means - 1):
        values = averaged(values, interval, length)
    moved = values - values[0]
    moved[1:-1] -= np.diff(moved, 2) / 12.0
    whole = np.append(0.0, np.cumsum(0.5 * (moved[1:] + moved[:-1])))
    begin = np.arange(values.size) - length / interval
    tick = np.clip(np.floor(begin).astype(np.int64), 0, values.size - 2)
    place = begin - tick
    before = whole[tick] + place * moved[tick] + 0.5 * place**2 * (moved[tick + 1] - moved[tick])
    return np.asarray(values[0] + (whole - np.where(begin > 0.0, before, 0.0)) * interval / length)


def later(values: Samples, ticks: float) -> Samples:
    """A signal (n,) that comes so many ticks later, on cubics through four samples; its ends stay constant.

    It is for what a model predicts, which is smooth; of noise near half the rate of the ticks it takes a part away.
    """
    whole = math.floor(ticks)
    part = ticks - whole
    weights = [
        math.prod((-part - other) / (node - other) for other in NODES if other != node) for node in NODES
    ]
    ahead, behind = max(whole, 0) + 2, max(-whole, 0) + 1
    padded = np.concatenate([np.full(ahead, values[0]), values, np.full(behind, values[-1])])
    first, result = ahead - whole, np.zeros(values.size)
    for weight, node in zip(weights, NODES, strict=True):
        result += weight * padded[first + node : first + node + values.size]
    return result
