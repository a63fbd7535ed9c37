"""How a data logger of the blind trial changes a channel.

A channel passes its logger in this order: calibration, hum of the mains, noise of the sensor, anti-alias filter,
converter, late channels, printed decimals, and the linear interpolation with which an import puts a logger of another
rate onto the plan's ticks. The parts before the converter are computed at the logger's own rate.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy import signal

from common.signals import Signal
from models.registry import Array
from validation.blind.logger.loggers import Logger

MAINS = 50.0  # Hz
ORDER = 4  # of the anti-alias filter and of the filters that colour noise: usual in amplifiers
CORRELATION = 0.95  # of neighbouring samples of the noise "ar1": it is correlated over some 20 samples
FREEDOM = 3  # degrees of freedom of Student's t: the smallest whole number that has a variance
DEEPEST = 0.1  # Hz, below which pink noise is flat: a test of 30 s shows less than three longer periods
RANGE = (1.5, 5.0)  # range of a converter over the peak of its channel: from a tight to a generous setting
DECIMALS = {"m": 1e-6, "N": 1.0, "m/s²": 1e-3}  # 3 decimals of mm, of kN, of m/s²
# Samples before the first: the slowest filter here has forgotten its start after some hundred.
SETTLING = 4096


def logged(
    logger: Logger, row: Signal, values: Array, level: float, interval: float, generator: np.random.Generator
) -> Array:
    """The recorded values of a channel with the true values (ticks,), one per `interval` s; SI units.

    `level` is the rms of the sensor's noise. Noise, phase of the hum and range are drawn from `generator`.
    """
    ticks: Array = np.arange(values.size, dtype=np.float64) * interval
    rate = logger.rate or 1.0 / interval
    count = values.size if not logger.rate else math.ceil(ticks[-1] * rate) + 1
    peak = float(np.max(np.abs(values), initial=0.0))
    phase, spread = generator.uniform(0.0, 2.0 * math.pi), generator.uniform(*np.log(RANGE))
    times: Array = np.arange(count, dtype=np.float64) / rate
    sensed = values if not logger.rate else resampled(ticks, values, times)
    sensed = logger.gain * sensed + logger.hum * peak * np.sin(2.0 * math.pi * MAINS * times + phase)
    sensed = sensed + level * COLOURS[logger.colour](generator, count, rate)
    if logger.cutoff:
        sensed = filtered(sensed, logger.cutoff, rate)
    if logger.bits and peak > 0.0:
        sensed = converted(sensed, float(np.exp(spread)) * peak, logger.bits)
    if logger.late and row.unit == "N":
        sensed = np.concatenate([np.full(logger.late, sensed[0]), sensed[: -logger.late]])
    if logger.printed:
        sensed = rounded(sensed, DECIMALS[row.unit])
    return np.interp(ticks, times, sensed) if logger.rate else sensed


def resampled(ticks: Array, values: Array, times: Array) -> Array:
    """The true signal at a logger's own times, by a cubic spline that reaches less than a sample beyond the last."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(ticks, values)(times))


def filtered(values: Array, cutoff: float, rate: float) -> Array:
    """Behind an analogue Butterworth filter of order 4 that starts in its steady state, with a ramped input."""
    analogue = signal.butter(ORDER, 2.0 * math.pi * cutoff, analog=True, output="ba")
    above, below, _ = signal.cont2discrete(analogue, 1.0 / rate, method="foh")
    return np.asarray(signal.lfilter(above[0], below, values - values[0]) + values[0])


def converted(values: Array, largest: float, bits: int) -> Array:
    """Behind a converter that reads from -`largest` to `largest` in 2^`bits` steps."""
    step = 2.0 * largest / 2**bits
    return np.clip(rounded(values, step), -largest, largest - step)


def rounded(values: Array, step: float) -> Array:
    """To whole steps."""
    return step * np.round(values / step)


def white(generator: np.random.Generator, count: int, _rate: float) -> Array:
    """Normal and uncorrelated; of rms 1, as all colours."""
    return generator.standard_normal(count)


def heavy_tailed(generator: np.random.Generator, count: int, _rate: float) -> Array:
    """Student's t, whose variance is n/(n - 2) with n degrees of freedom."""
    return generator.standard_t(FREEDOM, count) / math.sqrt(FREEDOM / (FREEDOM - 2.0))


def low_pass(rate: float, cutoff: float) -> tuple[Array, Array]:
    """A Butterworth filter of order 4."""
    above, below = signal.butter(ORDER, cutoff, fs=rate)
    return np.asarray(above), np.asarray(below)


def ar1(_rate: float) -> tuple[Array, Array]:
    """First-order autoregressive noise: 0.95 of the sample before, and white noise."""
    return np.ones(1), np.array([1.0, -CORRELATION])


FILTERS: dict[str, Callable[[float], tuple[Array, Array]]] = {
    "ar1": ar1,
    "low_pass_50": partial(low_pass, cutoff=50.0),
    "low_pass_100": partial(low_pass, cutoff=100.0),
    "low_pass_200": partial(low_pass, cutoff=200.0),
}
"""Digital filters that colour white noise: coefficients by the rate in Hz."""


def coloured(generator: np.random.Generator, count: int, rate: float, colour: str) -> Array:
    """White noise through a digital filter, in its stationary state and of rms 1."""
    above, below = FILTERS[colour](rate)
    impulse = signal.lfilter(above, below, np.eye(1, SETTLING)[0])
    noise = signal.lfilter(above, below, generator.standard_normal(count + SETTLING))[SETTLING:]
    return np.asarray(noise / np.sqrt(np.sum(impulse**2)))


def pink(generator: np.random.Generator, count: int, rate: float) -> Array:
    """Power per hertz as 1/f down to 0.1 Hz, and flat below."""
    size = 2 * count  # half of a longer record, because the record of an inverse transform is periodic
    frequency: Array = np.asarray(np.fft.rfftfreq(size, 1.0 / rate), dtype=np.float64)
    shape = pink_shape(frequency)
    noise = np.fft.irfft(np.fft.rfft(generator.standard_normal(size)) * shape, size)[:count]
    return np.asarray(noise / np.sqrt(np.mean(shape**2)))


def pink_shape(frequency: Array) -> Array:
    """Amplitude of pink noise at frequencies (Hz), up to a factor."""
    return np.asarray(1.0 / np.sqrt(np.maximum(frequency, DEEPEST)))


def colour_shape(colour: str, frequency: Array, rate: float) -> Array:
    """Amplitude of noise of rms 1 at frequencies (Hz) over that of white noise."""
    if colour in ("white", "heavy_tailed"):
        return np.ones(frequency.size)
    every = np.fft.rfftfreq(4 * frequency.size, 1.0 / rate)
    shape, whole = (
        _shape(colour, np.asarray(values, dtype=np.float64), rate) for values in (frequency, every)
    )
    return np.asarray(shape / np.sqrt(np.mean(whole**2)))


def _shape(colour: str, frequency: Array, rate: float) -> Array:
    """Amplitude at frequencies (Hz), up to a factor."""
    if colour == "pink":
        return pink_shape(frequency)
    above, below = FILTERS[colour](rate)
    return np.asarray(np.abs(signal.freqz(above, below, worN=frequency, fs=rate)[1]))


COLOURS: dict[str, Callable[[np.random.Generator, int, float], Array]] = {
    "white": white,
    "heavy_tailed": heavy_tailed,
    "pink": pink,
    **{colour: partial(coloured, colour=colour) for colour in FILTERS},
}
"""Noise of rms 1: generator, number of samples, rate in Hz."""
