"""Horiuchi's prediction against polynomials and its published weights."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models import compensators
from models.compensators import horiuchi
from tests.models.compensators.rig import DT, ask


@pytest.mark.parametrize(("order", "weights"), [(1, [2, -1]), (2, [3, -3, 1]), (3, [4, -6, 4, -1])])
def test_horiuchis_weights_are_the_published_ones(order: int, weights: list[float]) -> None:
    p = compensators.build("horiuchi", {"delay": 5 * DT, "order": order}, DT).params
    taps = p[horiuchi.FIRST :].reshape(-1, 2)
    assert p[horiuchi.TAPS] == order + 1
    assert taps[:, 0].tolist() == [5.0 * i for i in range(order + 1)]
    assert taps[:, 1].tolist() == weights


@given(
    order=st.integers(1, 3),
    ticks=st.floats(0.0, 40.0),
    coefficients=st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4),
)
@settings(max_examples=60, deadline=None)
def test_horiuchi_is_exact_for_polynomials_of_its_order(
    order: int, ticks: float, coefficients: list[float]
) -> None:
    polynomial = np.polynomial.Polynomial(coefficients[: order + 1])
    delay = ticks * DT
    built = compensators.build("horiuchi", {"delay": delay, "order": order}, DT)
    times = DT * np.arange(1, 200)
    got = [ask(built, float(polynomial(time)), present=float(polynomial(time - DT))) for time in times]
    past = order * 40 + 4  # ticks until the history is the polynomial's own
    assert got[past:] == pytest.approx(polynomial(times[past:] + delay), abs=1e-11)


def test_horiuchi_is_exact_for_a_cubic_with_a_delay_below_one_tick() -> None:
    polynomial = np.polynomial.Polynomial([0.1, -0.4, 2.0, 9.0])
    built = compensators.build("horiuchi", {"delay": 0.3 * DT, "order": 3}, DT)
    times = DT * np.arange(1, 50)
    got = [ask(built, float(polynomial(time)), present=float(polynomial(time - DT))) for time in times]
    assert got[5:] == pytest.approx(polynomial(times[5:] + 0.3 * DT), abs=1e-12)


def test_the_target_counts_as_constant_before_its_start() -> None:
    built = compensators.build("horiuchi", {"delay": 5 * DT, "order": 3}, DT)
    assert ask(built, 0.21, present=0.2) == pytest.approx(0.2 + 4 * 0.01)
