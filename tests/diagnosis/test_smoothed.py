"""Motions that drive a specimen without the white noise of their sensor."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diagnosis.recorded.smoothed import missed_at_turns, noise_left, smoothed, turns, without_small_turns

STEP, ROWS = 1.0 / 1024.0, 12 * 1024
NOISE = 3e-6  # m


def motion(highest: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Sines up to a frequency (Hz) that begin and end at rest, m."""
    t = STEP * np.arange(ROWS)
    waves = sum(0.01 / f * np.sin(2.0 * np.pi * f * t + f) for f in (0.5, 1.3, 4.1, highest))
    return np.asarray(waves * np.sin(np.pi * t / t[-1]) ** 2)


@pytest.mark.parametrize("highest", [9.0, 60.0])
def test_noise_above_the_motion_is_left_out_and_the_motion_is_not(highest: float) -> None:
    true = motion(highest)
    found = smoothed(true + NOISE * np.random.default_rng(1).standard_normal(ROWS))
    assert np.std(found - true) < 0.6 * NOISE
    # a dashpot multiplies noise by frequency: that of a reading is σ/(Δ√2) of its rate
    missed = np.gradient(found - true, STEP)
    assert np.std(missed) < 0.25 * NOISE / (np.sqrt(2.0) * STEP)


def test_the_noise_that_is_left_is_as_large_as_that_which_smoothing_leaves() -> None:
    true = motion(60.0)
    reading = true + NOISE * np.random.default_rng(1).standard_normal(ROWS)
    drawn = noise_left(reading, 5)
    assert np.std(drawn) == pytest.approx(np.std(smoothed(reading) - true), rel=0.15)
    assert np.std(smoothed(true + drawn) - true) == pytest.approx(np.std(drawn), rel=0.15)
    assert np.array_equal(drawn, noise_left(reading, 5))
    assert not noise_left(np.zeros(ROWS), 5).any()


def test_a_reading_that_moves_at_all_frequencies_or_has_no_noise_stays_as_it_is() -> None:
    rough = np.cumsum(np.random.default_rng(2).standard_normal(ROWS))
    for reading in (rough, motion(400.0) + 1e-12 * rough, np.zeros(ROWS)):
        assert np.array_equal(smoothed(reading), reading)


@given(st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=60), st.floats(1e-3, 0.5))
def test_a_path_goes_one_way_between_turns_and_back_by_more_than_the_least(
    rows: list[float], least: float
) -> None:
    path = np.array(rows)
    places = turns(path, least)
    assert places[0] == 0
    assert places[-1] == path.size - 1
    assert places == sorted(set(places))
    apart = np.abs(np.diff(path[places]))
    assert np.all(apart[1:-1] > least)


@given(st.integers(0, 99), st.floats(1e-4, 3e-3))
def test_rows_of_cycles_lose_the_turns_of_noise_and_keep_their_own(seed: int, noise: float) -> None:
    true = np.sin(np.linspace(0.0, 6.0 * np.pi, 900)) * np.linspace(0.3, 1.0, 900)
    read = true + noise * np.random.default_rng(seed).standard_normal(true.size)
    found = without_small_turns(read, noise)
    assert np.count_nonzero(np.diff(np.sign(np.diff(found)[np.diff(found) != 0.0]))) <= 8
    assert np.std(found - true) <= np.std(read - true) * (1.0 + 1e-9)
    assert np.array_equal(without_small_turns(true, noise), true)


def test_rows_miss_of_each_turn_what_the_motion_bends_between_them() -> None:
    """Of sines with any phase of their rows, the rms of what is between their peaks and the rows nearest to them."""
    rng = np.random.default_rng(8)
    places = np.arange(4000)
    missed, told = list[float](), list[float]()
    for phase, per_row in zip(rng.uniform(0.0, 2.0 * np.pi, 40), rng.uniform(0.05, 0.09, 40), strict=True):
        path = np.sin(per_row * places + phase)
        peaks = path[1:-1][(path[1:-1] > path[:-2]) & (path[1:-1] >= path[2:])]
        missed.append(float(np.mean(np.square(1.0 - peaks))))
        told.append(missed_at_turns(path) ** 2)
    assert np.sqrt(np.mean(told)) == pytest.approx(np.sqrt(np.mean(missed)), rel=0.05)
    assert missed_at_turns(np.linspace(0.0, 1.0, 50)) == 0.0
