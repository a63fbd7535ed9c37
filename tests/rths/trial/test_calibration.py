"""Calibration against published and constructed values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from common.errors import InputError
from validation.blind.results import calibration


@given(st.integers(1, 500), st.floats(0.0, 1.0), st.floats(0.5, 0.999))
def test_wilson_agrees_with_scipy(n: int, share: float, level: float) -> None:
    successes = round(share * n)
    wanted = stats.binomtest(successes, n).proportion_ci(level, "wilson")
    assert calibration.wilson(successes, n, level) == pytest.approx((wanted.low, wanted.high), abs=1e-12)


def test_a_calibration_without_cases_is_refused() -> None:
    with pytest.raises(InputError):
        calibration.wilson(0, 0)
    with pytest.raises(InputError):
        calibration.brier(np.array([]), np.array([]))
    with pytest.raises(InputError):
        calibration.brier(np.array([1.1]), np.array([1.0]))


def test_known_calibrations_have_the_expected_error() -> None:
    stated, came = np.array([0.9, 0.9, 0.2, 1.0]), np.array([True, False, False, True])
    assert calibration.brier(stated, came) == pytest.approx((0.01 + 0.81 + 0.04) / 4)
    assert calibration.expected_calibration_error(stated, came) == pytest.approx(
        0.75 * abs(2.8 / 3 - 2 / 3) + 0.25 * 0.2
    )
    table = calibration.reliability(stated, came, 10)
    assert table.cases.tolist() == [0, 0, 1, 0, 0, 0, 0, 0, 0, 3]
    assert np.isnan(table.stated[0])


def test_calibrated_probabilities_have_little_error() -> None:
    random = np.random.default_rng(0)
    stated = random.random(20_000)
    assert calibration.expected_calibration_error(stated, random.random(20_000) < stated) < 0.02
    assert calibration.expected_calibration_error(stated, random.random(20_000) < stated**2) > 0.1
