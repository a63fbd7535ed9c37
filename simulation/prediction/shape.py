"""The shape that explains most of a signal's error: an offset, a drift, a wrong amplitude, a delay, or noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.recording.run import Values

NONE = ""


class ErrorShape(NamedTuple):
    """The shape that explains most of a signal's error against the prediction."""

    kind: str  # offset, drift, size, delay or noise; empty where there is no error
    factor: float  # SI: offset, drift per second, relative change of size, delay in s, rms of the noise
    share: float  # of the error's energy


def shape_of(values: Values, predicted: Values, t: Values) -> ErrorShape:
    """The shape that explains most of values - predicted, both (ticks, storeys or slaves).

    `size` is a factor on the prediction, `delay` a factor on its time derivative. The energy of white noise is half of
    the energy of the differences between successive errors.
    """
    error = values - predicted
    power = float(np.sum(error**2))
    if t.size < 3 or not power > 0.0:
        return ErrorShape(NONE, 0.0, 0.0)
    shapes = {
        "offset": np.ones_like(error),
        "drift": np.broadcast_to((t - t[0])[:, None], error.shape),
        "size": predicted,
        "delay": -np.gradient(predicted, t, axis=0),
    }
    found = [ErrorShape(name, *fit(error, shape, power)) for name, shape in shapes.items()]
    white = min(0.5 * float(np.sum(np.diff(error, axis=0) ** 2)), power)
    found.append(ErrorShape("noise", float(np.sqrt(white / error.size)), white / power))
    return max(found, key=lambda one: one.share)


def fit(error: Values, shape: Values, power: float) -> tuple[float, float]:
    """The factor of a shape that is nearest to an error, and the share of its power that it explains."""
    norm, product = float(np.sum(shape**2)), float(np.sum(shape * error))
    return (product / norm, product**2 / (norm * power)) if norm > 0.0 else (0.0, 0.0)
