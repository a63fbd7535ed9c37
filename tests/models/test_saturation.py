"""A value behind a saturation, sudden or gradual."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from models.saturation import saturated

VALUES = st.floats(-1e6, 1e6)


@given(value=VALUES, level=st.floats(1e-3, 1e3), sharpness=st.floats(1.0, 20.0))
def test_a_saturation_is_odd_and_between_zero_and_the_level(
    value: float, level: float, sharpness: float
) -> None:
    found = saturated(value, level, sharpness)
    assert saturated(-value, level, sharpness) == -found
    assert 0.0 <= abs(found) <= min(abs(value), level) * (1.0 + 1e-12)
    assert found * value >= 0.0


@given(value=VALUES, level=st.floats(1e-3, 1e3))
def test_without_a_bend_it_is_clipped(value: float, level: float) -> None:
    assert saturated(value, level, math.inf) == max(-level, min(value, level))
    assert saturated(value, math.inf, 3.0) == value


def test_it_bends_by_the_formula() -> None:
    assert saturated(2.0, 2.0, 2.0) == pytest.approx(2.0 / math.sqrt(2.0))
    assert saturated(1.0, 2.0, 1.0) == pytest.approx(2.0 / 3.0)
    assert saturated(1e5, 2.0, 20.0) == pytest.approx(2.0)
