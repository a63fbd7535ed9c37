"""The systematic part of a residual, its windows, bands and amplitudes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from diagnosis.signals.systematic import systematic, systematic_rms
from diagnosis.signals.windows import band, bands, by_amplitude, intervals, windows
from models.registry import Array

H, N = 0.002, 15_000
T = np.arange(N) * H


def white(seed: int, n: int = N) -> Array:
    return np.random.default_rng(seed).standard_normal(n)


def rms(x: Array) -> float:
    return math.sqrt(float(np.mean(x**2)))


@pytest.mark.parametrize("seed", range(10))
def test_white_noise_is_not_systematic(seed: int) -> None:
    assert rms(systematic(3.0 * white(seed), 3.0, H)) < 0.15 * 3.0
    assert abs(systematic_rms(white(seed), 1.0).z) < 4.0
    assert band(white(seed), 1.0, H) == (0.0, 0.0)


@pytest.mark.parametrize("frequency", [0.3, 2.0, 9.0, 30.0])
def test_a_strong_systematic_part_is_recovered(frequency: float) -> None:
    wanted = 5.0 * np.exp(-0.05 * T) * np.sin(2.0 * np.pi * frequency * T)
    assert rms(systematic(wanted + white(1), 1.0, H) - wanted) < 0.25


def test_the_ends_of_a_residual_do_not_affect_each_other() -> None:
    ramp = 20.0 * T / T[-1]
    error = systematic(ramp + white(2), 1.0, H) - ramp
    assert rms(error[:500]) < 0.5
    assert rms(error[-500:]) < 0.5


def test_without_noise_the_whole_residual_is_systematic() -> None:
    x = white(3)
    np.testing.assert_allclose(systematic(x, 0.0, H), x, atol=1e-12)
    assert systematic_rms(x, 0.0).z == math.inf
    assert systematic_rms(np.zeros(N), 0.0) == (0.0, 0.0)
    assert not np.any(systematic(np.zeros(N), 0.0, H))


@pytest.mark.parametrize("seed", range(5))
def test_a_small_coherent_part_is_found(seed: int) -> None:
    part = 0.2 * math.sqrt(2.0) * np.sin(2.0 * np.pi * (1.0 + 0.2 * T) * T)
    found = systematic_rms(part + white(seed), 1.0)
    assert found.z > 5.0
    assert found.rms == pytest.approx(0.2, rel=0.25)


def test_the_test_statistic_is_standard_normal_under_white_noise() -> None:
    z = np.array([systematic_rms(white(seed, 4000), 1.0).z for seed in range(300)])
    assert abs(z.mean()) < 0.2
    assert z.std() == pytest.approx(1.0, abs=0.15)


def test_windows_show_when_a_residual_is_large() -> None:
    residual = white(4)
    residual[5000:7500] *= 5.0
    found = windows(residual, 1.0, H)
    assert found.t.size == 30
    assert found.length == pytest.approx(1.0)
    np.testing.assert_allclose(intervals(found, 2.0), [[10.0, 15.0]])
    assert intervals(found, 10.0) == []
    np.testing.assert_allclose(intervals(found, 0.0), [[0.0, 30.0]])
    assert np.sum(found.ratio**2) / 30.0 == pytest.approx(rms(residual) ** 2)


def test_windows_cover_records_of_odd_lengths() -> None:
    assert windows(white(5, 7), 1.0, H).t.size == 1
    assert windows(np.zeros(2301), 0.0, H).ratio.tolist() == [0.0] * 5
    assert np.all(np.isinf(windows(np.ones(2301), 0.0, H).ratio))


def test_frequency_bands_of_white_noise_have_the_noises_level() -> None:
    found = bands(2.0 * white(6), 2.0, H)
    assert np.mean(found.residual[1:-1] ** 2) == pytest.approx(found.noise[0] ** 2, rel=0.05)
    assert np.sum(found.residual**2) * found.frequency[1] == pytest.approx(4.0, rel=0.05)


def test_the_frequency_band_of_a_tone_and_of_a_chirp_is_found() -> None:
    low, high = band(3.0 * np.sin(2.0 * np.pi * 5.0 * T) + white(7), 1.0, H)
    assert 4.9 < low < 5.0 < high < 5.1
    sweep = 3.0 * np.sin(2.0 * np.pi * (2.0 * T + 4.0 * T**2 / (2.0 * 30.0)))
    low, high = band(sweep + white(8), 1.0, H)
    assert 1.9 < low < 3.0
    assert 5.0 < high < 6.2


def test_a_residual_that_grows_with_the_amplitude_is_shown_over_the_amplitude() -> None:
    amplitude = 1.0 + T / 30.0
    drive = amplitude * np.sin(2.0 * np.pi * 3.0 * T)
    at, ratio = by_amplitude(amplitude**2 * white(9), drive, 1.0, 5)
    np.testing.assert_allclose(at, [1.1, 1.3, 1.5, 1.7, 1.9], rtol=0.02)
    np.testing.assert_allclose(ratio, at**2, rtol=0.08)
