"""The spectral acceleration of a motion against closed forms and against another implementation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal

from simulation.sweep.intensity import spectral_acceleration


def test_the_spectral_acceleration_of_a_sine_at_resonance_agrees_with_the_closed_form() -> None:
    """The stationary response of an oscillator of ratio ζ is 1/(2ζ) times the excitation."""
    interval, period, ratio = 0.002, 0.5, 0.05
    t = interval * np.arange(20_000)
    ground = np.sin(2.0 * np.pi * t / period)
    assert spectral_acceleration(ground, interval, period, ratio) == pytest.approx(10.0, rel=2e-3)


@pytest.mark.parametrize(("period", "ratio"), [(0.5, 0.05), (5.0, 0.0), (0.1, 1.0), (0.02, 0.02)])
def test_the_spectral_acceleration_agrees_with_a_first_order_hold_of_scipy(
    period: float, ratio: float
) -> None:
    interval, omega = 0.002, 2.0 * math.pi / period
    ground = np.cumsum(np.random.default_rng(1).normal(size=4000))
    ground[0] = 0.0
    rates = ([-1.0], [1.0, 2.0 * ratio * omega, omega**2])
    above, below, _ = signal.cont2discrete(rates, interval, method="foh")
    wanted = omega**2 * np.max(np.abs(signal.lfilter(above.ravel(), below, ground)))
    assert spectral_acceleration(ground, interval, period, ratio) == pytest.approx(wanted, rel=1e-8)


def test_a_still_ground_has_no_spectral_acceleration() -> None:
    assert spectral_acceleration(np.zeros(100), 0.002, 0.5, 0.05) == 0.0
