"""The fragility fit, compared with closed forms, known probabilities, and another optimiser."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import optimize, special

from models.registry import Array
from simulation.sweep.fragility import Passed, chance, fit, likelihood, stripes


def drawn(median: float, dispersion: float, levels: Array, count: int, seed: int) -> tuple[Array, Passed]:
    """Tests at levels whose capacity is lognormal: (n,) intensities, and which passed."""
    random = np.random.default_rng(seed)
    intensity = np.repeat(levels, count)
    capacity = median * np.exp(dispersion * random.standard_normal(intensity.size))
    return intensity, intensity > capacity


def test_the_curve_of_two_intensities_passes_through_both_shares() -> None:
    intensity = np.repeat([1.0, 2.0], 10)
    passed = np.array([True] * 2 + [False] * 8 + [True] * 7 + [False] * 3)
    found = fit(intensity, passed)
    slope = (special.ndtri(0.7) - special.ndtri(0.2)) / math.log(2.0)
    assert found.dispersion == pytest.approx(1.0 / slope, rel=1e-8)
    assert found.median == pytest.approx(math.exp(-special.ndtri(0.2) / slope), rel=1e-8)
    assert chance(found, np.array([1.0, 2.0])) == pytest.approx([0.2, 0.7], rel=1e-8)


def test_the_fit_agrees_with_the_maximum_that_another_optimiser_finds() -> None:
    intensity, passed = drawn(0.8, 0.4, np.linspace(0.2, 2.0, 10), 30, 1)
    found = fit(intensity, passed)
    groups = stripes(intensity, passed)
    x = np.log([one.intensity for one in groups])
    n, k = (np.array([one[place] for one in groups], dtype=float) for place in (1, 2))

    def cost(at: Array) -> float:
        return -likelihood((x - at[0]) / np.exp(at[1]), n, k)

    best = optimize.minimize(cost, [0.0, 0.0], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12})
    assert found.median == pytest.approx(math.exp(best.x[0]), rel=1e-5)
    assert found.dispersion == pytest.approx(math.exp(best.x[1]), rel=1e-5)


def test_intervals_of_90_percent_cover_the_true_value_nine_times_of_ten() -> None:
    held = np.zeros(2)
    count = 300
    for seed in range(count):
        found = fit(*drawn(0.8, 0.4, np.linspace(0.3, 1.8, 8), 40, seed))
        low, high = found.median_interval
        held[0] += low <= 0.8 <= high
        low, high = found.dispersion_interval
        held[1] += low <= 0.4 <= high
    assert np.all(np.abs(held / count - 0.9) < 3.0 * math.sqrt(0.09 / count))  # three standard errors


@pytest.mark.parametrize(
    ("passed", "why"),
    [
        ([False] * 4, "the limit is passed in no test"),
        ([True] * 4, "the limit is passed in every test"),
        (
            [False, False, True, True],
            "the limit is passed from 3 on and nowhere below 2: the curve is a step",
        ),
        ([True, True, False, False], "the chance does not grow with the intensity"),
    ],
)
def test_a_fit_without_a_curve_states_the_reason(passed: list[bool], why: str) -> None:
    found = fit(np.array([1.0, 2.0, 3.0, 4.0]), np.array(passed))
    assert found.why_not == why
    assert math.isnan(found.median)


def test_shares_of_another_law_are_flagged_and_those_of_the_lognormal_law_seldom() -> None:
    levels = np.linspace(0.3, 1.8, 8)
    doubted = sum(fit(*drawn(0.8, 0.4, levels, 40, seed)).agreement < 0.05 for seed in range(200))
    assert doubted < 30  # of 200 at 5 %, with three standard errors and what small counts add
    intensity = np.repeat(levels, 100)
    share = np.repeat([10, 10, 10, 90, 90, 90, 90, 90], 100)
    passed = np.tile(np.arange(100), levels.size) < share
    assert fit(intensity, passed).agreement < 1e-6
