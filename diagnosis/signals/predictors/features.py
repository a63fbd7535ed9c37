"""What a residual may depend on: the past, the rates, the signs, the play and the drift of the inputs."""

from __future__ import annotations

import itertools

import numpy as np
from scipy import ndimage

from diagnosis.signals.mask import Mask
from models.registry import Array

LAGS = (-0.02, -0.01, 0.0, 0.01, 0.02, 0.03, 0.04, 0.06, 0.08, 0.11, 0.15, 0.2)  # s
SHARPNESS = (2.0, 10.0, 50.0)  # of tanh(k·x/rms), which goes from a bend to a sign
PLAYS = (0.005, 0.015, 0.03, 0.06, 0.1, 0.15, 0.22, 0.32, 0.45, 0.65)  # half widths over the peak
STILL = (0.02, 0.04)  # s, over which a signal is smoothed before the sign of its rate is taken
WAVES = 6  # cosines over the record
PAIRED = 4  # inputs, up to which their products with each other are taken


def features(inputs: Array, interval: float, fit: Mask, *, timeless: bool = False) -> Array:
    """Standardised features (n, q) of inputs (n, p) sampled every `interval` s; constants are left out.

    Mean and scale are those where `fit` (n,) is true. The first column is one everywhere. With `timeless`, functions of
    time alone are left out, which slow noise may well be.
    """
    scale = np.maximum(np.std(inputs, axis=0), np.finfo(np.float64).tiny)
    moving = np.ptp(inputs, axis=0) > 0.0
    u = ((inputs - inputs.mean(axis=0)) / scale)[:, moving]
    rate = scaled(np.gradient(u, axis=0))
    parts = [
        slow(len(inputs))[:, : 0 if timeless else None],
        lagged(u, interval),
        *(bent(x) for x in (u, rate)),
        calm(u, interval),
        mixed(u, rate),
        scaled(np.gradient(rate, axis=0)),
        plays(u),
        aged(u, rate),
        pairs(np.hstack([u, rate])) if u.shape[1] <= PAIRED else u[:, :0],
    ]
    return standardised(np.hstack(parts), fit)


def standardised(x: Array, fit: Mask) -> Array:
    """Columns (n, q) of zero mean and unit deviation where `fit` is true, after a column of ones."""
    mean, deviation = x[fit].mean(axis=0), x[fit].std(axis=0)
    kept = deviation > 1e-9 * np.max(np.abs(x), axis=0, initial=1e-300)
    return np.hstack([np.ones((len(x), 1)), (x[:, kept] - mean[kept]) / deviation[kept]])


def scaled(x: Array) -> Array:
    """Columns (n, p) over their rms."""
    rms = np.sqrt(np.mean(x**2, axis=0))
    return np.asarray(x / np.where(rms > 0.0, rms, 1.0))


def slow(n: int) -> Array:
    """Slow functions of time (n, 1 + WAVES): a ramp and cosines."""
    t = (np.arange(n) + 0.5) / n
    return np.column_stack([t, *(np.cos(np.pi * k * t) for k in range(1, WAVES + 1))])


def lagged(x: Array, interval: float) -> Array:
    """Columns (n, p) at `LAGS`; before the first and after the last sample these go on."""
    shifts = sorted({round(lag / interval) for lag in LAGS})
    place = np.arange(len(x))
    return np.hstack([x[np.clip(place - shift, 0, len(x) - 1)] for shift in shifts])


def bent(x: Array) -> Array:
    """Nonlinear functions of columns (n, p): signs soft to sharp, and powers."""
    return np.hstack([*(np.tanh(k * x) for k in SHARPNESS), np.abs(x), x * np.abs(x), x**2, x**3])


def calm(x: Array, interval: float) -> Array:
    """Sharp signs (n, 4·p) of the rates of smoothed columns (n, p), for motion small beside its largest."""
    rates = [scaled(np.gradient(ndimage.gaussian_filter1d(x, s / interval, axis=0), axis=0)) for s in STILL]
    return np.hstack([np.tanh(k * rate) for rate in rates for k in (50.0, 1000.0)])


def mixed(x: Array, rate: Array) -> Array:
    """Products of columns (n, p) with their rates, as in damping that goes with displacement."""
    sign = np.tanh(SHARPNESS[-1] * rate)
    return np.hstack([x * rate, np.abs(x) * rate, np.abs(x) * sign, x**2 * rate, x * rate**2])


def pairs(x: Array) -> Array:
    """Products (n, …) of every two of the columns (n, p)."""
    products = [x[:, a] * x[:, b] for a, b in itertools.combinations(range(x.shape[1]), 2)]
    return np.column_stack(products) if products else x[:, :0]


def aged(x: Array, rate: Array) -> Array:
    """What changes with the largest value so far, and with time: (n, 5·p)."""
    so_far = np.maximum.accumulate(np.abs(x), axis=0)
    t = np.linspace(-1.0, 1.0, len(x))[:, None]
    return np.hstack([so_far, so_far * x, so_far * rate, t * x, t * rate])


def plays(x: Array) -> Array:
    """Play operators (n, p·widths) of columns (n, p), less the columns: a Prandtl-Ishlinskii bank.

    `y ← min(max(y, x − r), x + r)` with half widths r of `PLAYS` times the largest value.

    Source: Visintin, Differential Models of Hysteresis (1994), ch. III.
    """
    width = np.outer(np.array(PLAYS), np.max(np.abs(x), axis=0, initial=0.0)).ravel()
    repeated = np.tile(x, (1, len(PLAYS)))
    low, high = repeated - width, repeated + width
    result = np.empty_like(repeated)
    y = np.zeros(repeated.shape[1])
    for k in range(len(x)):
        y = np.minimum(np.maximum(y, low[k]), high[k])
        result[k] = y
    return np.asarray(result - repeated)
