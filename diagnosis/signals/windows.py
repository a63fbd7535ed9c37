"""The times, frequencies and amplitudes at which a residual exceeds the noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import signal

from diagnosis.signals.systematic import spectrum, systematic
from models.indicators.checks import checked
from models.registry import Array

SEGMENT = 2.0  # s, of Welch's method
HELD = 0.8  # share of the systematic energy in its band
FAINT = 0.15  # of the noise's rms, up to which a systematic part may be chance
PAD = 0.1  # of a drive, mirrored at each end


class Windows(NamedTuple):
    """A residual window by window."""

    t: Array  # (m,) s, centres, from the first sample on
    ratio: Array  # (m,) rms of the residual over that of the noise
    length: float  # s


class Bands(NamedTuple):
    """Amplitude densities, one-sided."""

    frequency: Array  # (m,) Hz
    residual: Array  # (m,) unit/√Hz
    noise: Array  # (m,) unit/√Hz, the same everywhere


def over(rms: Array, noise_rms: float) -> Array:
    """Rms over the noise's; without noise infinite, or zero where there is no residual either."""
    if noise_rms > 0.0:
        return np.asarray(rms / noise_rms)
    return np.where(rms > 0.0, np.inf, 0.0)


def windows(residual: Array, noise_rms: float, interval: float, length: float = 1.0) -> Windows:
    """Rms ratio of a residual (n,) in equal windows, as near to `length` s as fills the record.

    Raises:
        InputError: empty or not finite.
    """
    checked(residual=residual)
    duration = residual.size * interval
    count = min(max(1, round(duration / length)), residual.size)
    edges = np.round(np.linspace(0, residual.size, count + 1)).astype(np.int64)
    centres = np.asarray(0.5 * (edges[1:] + edges[:-1]) * interval, dtype=np.float64)
    rms = np.sqrt(np.add.reduceat(residual**2, edges[:-1]) / np.diff(edges))
    return Windows(centres, over(rms, noise_rms), duration / count)


def intervals(parts: Windows, threshold: float) -> list[list[float]]:
    """Spans [t0, t1] in s of neighbouring windows whose ratio exceeds the threshold."""
    above = np.concatenate([[False], parts.ratio > threshold, [False]])
    change = np.flatnonzero(np.diff(above.astype(np.int8)))
    edges = np.arange(parts.t.size + 1) * parts.length
    return [[float(edges[a]), float(edges[b])] for a, b in zip(change[::2], change[1::2], strict=True)]


def bands(residual: Array, noise_rms: float, interval: float) -> Bands:
    """Amplitude density of a residual (n,) by Welch's method, and that of white noise of the given rms.

    Hann windows of `SEGMENT`, half overlapping; the mean is kept.

    Raises:
        InputError: empty or not finite.
    """
    checked(residual=residual)
    size = min(residual.size, max(8, round(SEGMENT / interval)))
    frequency, power = signal.welch(residual, 1.0 / interval, nperseg=size, detrend=False)
    noise = np.full(frequency.size, noise_rms * np.sqrt(2.0 * interval))
    return Bands(np.asarray(frequency), np.sqrt(power), noise)


def band(residual: Array, noise_rms: float, interval: float) -> tuple[float, float]:
    """Narrowest band (Hz) that holds 80 % of the systematic energy of a residual (n,); (0, 0) where none is.

    Raises:
        InputError: empty or not finite.
    """
    energy = spectrum(systematic(residual, noise_rms, interval)) ** 2
    total = float(energy.sum())
    if total <= residual.size * (FAINT * noise_rms) ** 2:
        return 0.0, 0.0
    below = np.concatenate([[0.0], np.cumsum(energy)]) / total
    last = np.searchsorted(below, below + HELD)
    first = np.flatnonzero(last < below.size)
    best = int(first[np.argmin(last[first] - first)])
    line = 0.5 / (residual.size * interval)
    return max(0.0, (best - 0.5) * line), float((last[best] - 0.5) * line)


def by_amplitude(residual: Array, drive: Array, noise_rms: float, count: int) -> tuple[Array, Array]:
    """Rms ratio of a residual (n,) by the local amplitude of its drive (n,): `count` bins of equal size.

    Gives the mean amplitude of each bin, ascending, in the drive's unit, and the ratio there. The amplitude
    is the size of the analytic signal of the drive less its mean, with mirrored ends.

    Raises:
        InputError: empty, unequal or not finite.
    """
    checked(residual=residual, drive=drive)
    pad = min(drive.size - 1, max(1, round(PAD * drive.size)))
    mirrored = np.pad(drive - drive.mean(), pad, mode="reflect")
    envelope = np.abs(signal.hilbert(mirrored))[pad : pad + drive.size]
    parts = np.array_split(np.argsort(envelope, kind="stable"), min(count, drive.size))
    amplitude = np.array([envelope[part].mean() for part in parts])
    rms = np.array([np.sqrt(np.mean(residual[part] ** 2)) for part in parts])
    return amplitude, over(rms, noise_rms)
