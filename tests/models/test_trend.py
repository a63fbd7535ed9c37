"""The extrapolation of the acceleration by one tick."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from models import trend
from models.transfer_systems import delay

FINITE = st.floats(-1e3, 1e3)


@given(level=FINITE, slope=FINITE)
def test_a_straight_line_is_continued_exactly(level: float, slope: float) -> None:
    recent = np.zeros(trend.RECENT)
    for k in range(trend.RECENT):
        delay.remember(recent, level + slope * 0.002 * k)
    steep = trend.steepness(recent)
    assert steep / 0.002 == pytest.approx(slope, abs=1e-6)
    assert trend.ahead(recent, steep) == pytest.approx(level + slope * 0.002 * trend.RECENT, abs=1e-8)


def test_a_sine_is_extrapolated_by_one_tick_within_one_percent() -> None:
    omega, recent, errors = 4.0 * np.pi, np.zeros(trend.RECENT), []
    for k in range(500):
        delay.remember(recent, np.sin(omega * 0.002 * k))
        if k > trend.RECENT:
            errors.append(trend.ahead(recent, trend.steepness(recent)) - np.sin(omega * 0.002 * (k + 1)))
    assert np.max(np.abs(errors)) < 0.01
