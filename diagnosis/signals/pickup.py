"""Narrow lines of constant amplitude in a residual: mains and other machines that a sensor picks up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from models.registry import Array

LOWEST = 8.0  # Hz, below which a line may well be the motion's own
SLOWEST = 2.0  # Hz, below which a drift may look like one
AROUND = 1.5  # Hz to each side over which the density beside a line is taken
CHANCE = 1e-4  # of a line in noise without one
MOST_LINES = 12
PARTS = 6  # of the record, in which a line's amplitude is compared
STEADY = 0.35  # by which its amplitude may vary from the mean, relative; noise adds to that
ALSO = 1e-3  # chance of a line in another reading, at the one frequency where it is looked for
MAINS = (50.0, 60.0)  # Hz
NEAR = 0.1  # Hz, within which a frequency is that of the mains or a harmonic


class Pickup(NamedTuple):
    """A narrow line in a reading."""

    frequency: float  # Hz
    amplitude: float  # in the reading's unit


class Spectrum(NamedTuple):
    """Power of a residual by frequency, and what it is around each."""

    power: Array  # (lines,)
    around: Array  # (lines,) mean power of the noise
    line: float  # Hz between two


def spectrum(residual: Array, interval: float) -> Spectrum:
    """The spectrum of a residual (n,) behind a Hann window."""
    power = np.abs(np.fft.rfft(residual * np.hanning(residual.size))) ** 2
    line = 1.0 / (residual.size * interval)
    size = 2 * max(8, round(AROUND / line)) + 1
    return Spectrum(power, ndimage.median_filter(power, size, mode="reflect") / math.log(2.0), line)


def pickups(residual: Array, interval: float, lowest: float = LOWEST) -> list[Pickup]:
    """Lines of a residual (n,) that stand out of the density around them and keep amplitude and phase."""
    power, around, line = spectrum(residual, interval)
    places = np.arange(power.size)
    above = power > math.log(residual.size / CHANCE) * around
    peak = (power == ndimage.maximum_filter1d(power, 7)) & above & (places * line > lowest)
    found = []
    for place in sorted(np.flatnonzero(peak & (places < power.size - 2)), key=lambda k: -power[k])[
        :MOST_LINES
    ]:
        frequency = refined(power, int(place)) * line
        amplitude = steady(residual, frequency, interval)
        if amplitude > 0.0:
            found.append(Pickup(frequency, amplitude))
    return found


def shows(residual: Array, frequency: float, interval: float) -> bool:
    """Whether a residual (n,) has a line at a frequency (Hz) that is known from elsewhere."""
    power, around, line = spectrum(residual, interval)
    place = min(round(frequency / line), power.size - 1)
    return bool(power[place] > -math.log(ALSO) * around[place])


def moving(found: Sequence[Sequence[Pickup]], residuals: Array, interval: float) -> list[list[Pickup]]:
    """The lines of residuals (n, signals), by signal, that something moving makes: no mains, and several show them.

    A machine's motion is seen by every sensor near it, a disturbance of a cable by one alone, and the mains by all.
    """
    result: list[list[Pickup]] = []
    for place, lines in enumerate(found):
        others = [k for k in range(residuals.shape[1]) if k != place]
        result.append(
            [
                one
                for one in lines
                if not of_mains(one.frequency)
                and any(shows(residuals[:, k], one.frequency, interval) for k in others)
            ]
        )
    return result


def refined(power: Array, place: int) -> float:
    """Place of a peak between the lines of a spectrum, by a parabola through the logarithms."""
    a, b, c = (math.log(max(float(value), 1e-300)) for value in power[place - 1 : place + 2])
    bend = a - 2.0 * b + c
    return place + (0.5 * (a - c) / bend if bend < 0.0 else 0.0)


def steady(residual: Array, frequency: float, interval: float) -> float:
    """Amplitude of a line that is the same throughout a residual (n,), 0 where it comes and goes.

    Each part's amplitude and phase are held against those of the whole, with what noise makes them differ by.
    """
    t = np.arange(residual.size) * interval
    wave = np.exp(-2j * np.pi * frequency * t)
    parts = np.array([2.0 * np.mean(piece) for piece in np.array_split(residual * wave, PARTS)])
    neighbours = [
        np.abs(2.0 * np.mean(piece))
        for shift in (-AROUND, AROUND)
        for piece in np.array_split(residual * np.exp(-2j * np.pi * (frequency + shift) * t), PARTS)
    ]
    mean = complex(np.mean(parts))
    noise = 1.2 * float(np.median(neighbours))  # rms of a complex normal number over the median of its size
    apart = np.abs(parts - mean)
    return abs(mean) if np.all(apart < STEADY * abs(mean) + 2.5 * noise) else 0.0


def waves(residual: Array, lines: Sequence[Pickup], interval: float) -> Array:
    """The lines' part (n,) of a residual (n,), by least squares over all lines at once."""
    if not lines:
        return np.zeros_like(residual)
    t = np.arange(residual.size) * interval
    columns = [shape(2.0 * np.pi * item.frequency * t) for item in lines for shape in (np.cos, np.sin)]
    x = np.column_stack(columns)
    return np.asarray(x @ np.linalg.lstsq(x, residual, rcond=None)[0])


def named(lines: Sequence[Pickup]) -> tuple[float, ...]:
    """Frequencies of lines, ascending; those of mains and harmonics by their nominal value."""
    return tuple(sorted({nominal(item.frequency) for item in lines}))


def nominal(frequency: float) -> float:
    """A frequency, that of the mains or a harmonic where it is near one."""
    return next((multiple for multiple in harmonics(frequency)), round(frequency, 2))


def of_mains(frequency: float) -> bool:
    """Whether a frequency is that of the mains or of a harmonic."""
    return bool(harmonics(frequency))


def harmonics(frequency: float) -> list[float]:
    """The frequencies of the mains and their harmonics that a frequency is near to."""
    multiples = [max(1, round(frequency / mains)) * mains for mains in MAINS]
    pairs = zip(multiples, MAINS, strict=True)
    return [multiple for multiple, mains in pairs if abs(frequency - multiple) < NEAR * multiple / mains]
