"""How strong a ground motion is: spectral acceleration of a linear oscillator."""

from __future__ import annotations

import math

import numpy as np
from scipy import signal

from models.registry import Array


def spectral_acceleration(ground: Array, interval: float, period: float, damping_ratio: float) -> float:
    """Pseudo-spectral acceleration ω²·max|x| (m/s²) of an oscillator under a ground acceleration (n,) in m/s².

    `ẍ + 2ζω·ẋ + ω²·x = −z̈` from rest, exact for an acceleration that is linear between its samples (first-order
    hold), at intervals and with a period in s. Source: N. C. Nigam, P. C. Jennings, Calculation of response spectra
    from strong-motion earthquake records, Bull. Seism. Soc. Am. 59 (1969).
    """
    omega = 2.0 * math.pi / period
    continuous = ([-1.0], [1.0, 2.0 * damping_ratio * omega, omega**2])
    above, below, _ = signal.cont2discrete(continuous, interval, method="foh")
    return float(omega**2 * np.max(np.abs(signal.lfilter(above.ravel(), below, ground)), initial=0.0))
