"""The analogue low-pass filters of data loggers."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

# The low-pass filters usual before the converters of data loggers, those with a ripple in what they pass last.
FILTERS = ("butterworth", "bessel", "chebyshev", "elliptic")
RIPPLING = FILTERS[2:]
Samples = NDArray[np.float64]


@dataclass(frozen=True)
class LoggerFilter:
    """The analogue low-pass filter before a converter; what stands still passes it unchanged."""

    type: str
    order: int
    cutoff: float  # Hz, at which 3 dB are lost, or at which the ripple of a filter ends
    ripple: float = 0.0  # dB, of what a Chebyshev filter of type I or an elliptic one passes
    attenuation: float = 0.0  # dB, at least, of what an elliptic one stops

    @cached_property
    def transfer(self) -> tuple[Samples, Samples]:
        """Coefficients of numerator and denominator in s (rad/s), the highest power first."""
        from scipy import signal

        zeros, poles, gain = _design(self.type, self.order, self.ripple, self.attenuation)
        scaled = gain * self.cutoff ** (poles.size - zeros.size)
        above, below = signal.zpk2tf(self.cutoff * zeros, self.cutoff * poles, scaled)
        return np.atleast_1d(above), np.asarray(below)

    def response(self, frequency: Samples) -> NDArray[np.complex128]:
        """Frequency response at `frequency` (Hz)."""
        above, below = self.transfer
        s = 2j * math.pi * np.asarray(frequency)
        return np.asarray(np.polyval(above, s) / np.polyval(below, s), dtype=np.complex128)

    @property
    def modes(self) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Poles p (1/s) with no negative imaginary part and weights w (1/s): the real part of Σ w/(s − p)."""
        poles, weights, _ = _modes(self.type, self.order, self.ripple, self.attenuation)
        return self.cutoff * poles, self.cutoff * weights

    def filtered(self, values: Samples, interval: float) -> Samples:
        """A signal (ticks,) after the filter, smooth between ticks and constant at its first value before them.

        Straight lines between ticks would take the share (ω·interval)²/12 of a wave of frequency ω away, which shows in
        a reading that moves 10,000 times its noise; a twelfth of the second differences gives that back.
        Pole by pole, because the coefficients of a high order lose all digits where the cutoff is far below the rate.
        """
        from scipy import signal

        moved = values - values[0]
        moved[1:-1] -= np.diff(moved, 2) / 12.0
        at_once = _modes(self.type, self.order, self.ripple, self.attenuation)[2]
        result = np.asarray(values[0] + at_once * (values - values[0]), dtype=np.float64)
        for pole, weight in zip(*self.modes, strict=True):
            result += signal.lfilter(*_section(complex(pole) * interval, complex(weight) / pole), moved)
        return result


@cache
def _design(
    kind: str, order: int, ripple: float, attenuation: float
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], float]:
    """Zeros, poles and gain of a filter whose cutoff is 1 Hz, and whose gain at rest is one."""
    from scipy import signal

    shared: dict[str, Any] = {"Wn": 2.0 * math.pi, "analog": True, "output": "zpk"}
    if kind == "bessel":
        zeros, poles, gain = signal.bessel(order, norm="mag", **shared)
    elif kind == "chebyshev":
        zeros, poles, gain = signal.cheby1(order, ripple, **shared)
    elif kind == "elliptic":
        zeros, poles, gain = signal.ellip(order, ripple, attenuation, **shared)
    else:
        zeros, poles, gain = signal.butter(order, **shared)
    at_rest = gain * np.prod(-zeros) / np.prod(-poles)
    return zeros, poles, float(gain / at_rest.real)


@cache
def _modes(
    kind: str, order: int, ripple: float, attenuation: float
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], float]:
    """Poles and weights of a filter whose cutoff is 1 Hz, and its gain for what is infinitely fast."""
    zeros, poles, gain = _design(kind, order, ripple, attenuation)
    apart = poles[:, None] - poles[None, :] + np.eye(poles.size)
    weights = gain * np.prod(poles[:, None] - zeros[None, :], axis=1) / np.prod(apart, axis=1)
    upper = poles.imag >= 0.0
    paired = np.where(poles.imag > 0.0, 2.0, 1.0)[upper] * weights[upper]
    return poles[upper], paired, gain if zeros.size == poles.size else 0.0


def _section(step: complex, weight: complex) -> tuple[list[float], list[float]]:
    """Coefficients over ticks of the real part of weight·p/(s − p) with step = p·interval, for straight lines.

    With a = p·interval, k = eᵃ and z⁻¹ a tick before, weight·((k − 1 − a) + (1 + k·(a − 1))·z⁻¹)/(a·(1 − k·z⁻¹)).
    """
    kept = cmath.exp(step)
    now = weight / step * complex(np.expm1(step) - step)
    before = weight / step * (1.0 + kept * (step - 1.0))
    if step.imag == 0.0:
        return [now.real, before.real], [1.0, -kept.real]
    across = [now.real, (before - now * kept.conjugate()).real, -(before * kept.conjugate()).real]
    return across, [1.0, -2.0 * kept.real, abs(kept) ** 2]
