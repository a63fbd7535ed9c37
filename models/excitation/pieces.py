"""Pieces of a bench test: steps, sines, sweeps, random waves, static cycles; each starts and ends at zero."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from models.registry import Array


class Piece(NamedTuple):
    """One piece on the grid of ticks."""

    name: str
    values: Array  # (ticks,), m or N
    smooth: bool  # whether it has derivatives that a compensator can use
    made_with: dict[str, float]


def tapered(values: Array, ticks: int) -> Array:
    """The values with a smooth fade of `ticks` at both ends."""
    fade = 0.5 - 0.5 * np.cos(np.pi * np.arange(ticks) / ticks)
    result = values.copy()
    result[:ticks] *= fade
    result[values.size - ticks :] *= fade[::-1]
    return result


def static_cycles(
    interval: float, amplitudes: Sequence[float], *, cycles: int, speed: float, hold: float
) -> Piece:
    """Cycles at constant speed (m/s), `cycles` at each amplitude (m), held for `hold` s at every turn."""
    corners = [0.0]
    for amplitude in amplitudes:
        corners += [amplitude, -amplitude] * cycles
    corners.append(0.0)
    reached = np.cumsum(np.abs(np.diff(corners)) / speed + hold) - hold
    at = np.concatenate([[0.0], np.column_stack([reached, reached + hold]).ravel()])
    t = np.arange(1, math.ceil(at[-1] / interval) + 1) * interval
    made_with = {"speed": speed, "cycles": float(cycles)}
    made_with |= {f"amplitude_{number}": amplitude for number, amplitude in enumerate(amplitudes, 1)}
    return Piece(
        "static", np.interp(t, at, np.concatenate([[0.0], np.repeat(corners[1:], 2)])), True, made_with
    )


def steps(interval: float, *, height: float, hold: float, count: int) -> Piece:
    """Steps up to `height` and back to zero, `count` in all, each held for `hold` s."""
    level = [height if number % 2 == 0 else 0.0 for number in range(count)]
    values = np.repeat(level, round(hold / interval))
    return Piece("step", values, False, {"height": height, "hold": hold, "count": float(count)})


def sine(interval: float, frequency: float, *, amplitude: float, cycles: int) -> Piece:
    """`cycles` of a sine, faded in and out over one cycle each."""
    count = round(cycles / frequency / interval)
    t = np.arange(count) * interval
    values = amplitude * np.sin(2.0 * np.pi * frequency * t)
    made_with = {"frequency": frequency, "amplitude": amplitude}
    return Piece(
        f"sine {frequency:g} Hz", tapered(values, round(1.0 / frequency / interval)), True, made_with
    )


def random_wave(
    interval: float, *, band: tuple[float, float], rms: float, duration: float, seed: int
) -> Piece:
    """A stationary wave of equal power in a band (Hz): sines of random phases drawn from the seed."""
    count = round(duration / interval)
    frequencies = np.arange(band[0], band[1], 1.0 / duration)
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, frequencies.size)
    t = np.arange(count) * interval
    values = np.sin(2.0 * np.pi * frequencies[:, None] * t + phases[:, None]).sum(axis=0)
    values *= rms / math.sqrt(frequencies.size / 2.0)
    made_with = {"lowest": band[0], "highest": band[1], "rms": rms, "seed": float(seed)}
    return Piece("random", tapered(values, round(1.0 / interval)), True, made_with)


def sweep(
    interval: float, band: tuple[float, float], *, duration: float, amplitude: float, curvature: float
) -> Piece:
    """A sine whose frequency grows exponentially through a band (Hz).

    Its amplitude is `amplitude` (m or N), less where the second derivative would exceed `curvature`.
    """
    t = np.arange(round(duration / interval)) * interval
    growth = math.log(band[1] / band[0]) / duration
    frequency = band[0] * np.exp(growth * t)
    phase = 2.0 * np.pi * band[0] * np.expm1(growth * t) / growth
    size = np.minimum(amplitude, curvature / (2.0 * np.pi * frequency) ** 2)
    values = tapered(size * np.sin(phase), round(1.0 / interval))
    made_with = {"lowest": band[0], "highest": band[1], "amplitude": amplitude}
    return Piece("sweep", values, True, made_with)
