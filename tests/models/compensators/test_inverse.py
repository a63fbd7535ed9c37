"""The fixed inverse of a lag with dead time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from models import compensators
from models.compensators import inverse
from tests.models.compensators.rig import DT, GAINS, ask, delay, drive, response, sine

PLANT = {"delay": 0.014, "time_constant": 0.030, "gain": 0.8}


@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_coefficients_equal_those_of_the_series(order: int) -> None:
    """Against the product of the two series, (1 + Ts)·Σ (Ls)^j/j!, cut after the order."""
    p = compensators.build("inverse", {**PLANT, "order": order}, DT).params
    lead = [0.014**j / math.factorial(j) for j in range(5)]
    product = np.convolve(lead, [1.0, 0.030])[: order + 1] / 0.8
    assert p[4:] == pytest.approx(np.pad(product, (0, 3 - order)), rel=1e-12)


def test_without_a_lag_the_inverse_is_the_taylor_series() -> None:
    fixed = compensators.build("inverse", {"delay": 0.044, "time_constant": 0.0, "order": 3}, DT)
    taylor = compensators.build("taylor", {"lead": 0.044, "order": 3}, DT)
    numbers = (0.1, -2.0, 30.0, 400.0)
    assert ask(fixed, *numbers) == pytest.approx(ask(taylor, *numbers), rel=1e-14)


def test_without_dead_time_the_first_order_inverse_is_exact() -> None:
    c = inverse.coefficients(0.0, 0.03, 2.0, 3.0)
    assert c.tolist() == [0.5, 0.015, 0.0, 0.0]


@pytest.mark.parametrize("frequency", [0.5, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("kind", ["inverse", "pid_inverse"])
def test_each_order_reduces_the_actuators_tracking_error(kind: str, frequency: float) -> None:
    gains = GAINS if kind == "pid_inverse" else {}
    plant = {"delay": 0.014, "time_constant": 0.030}
    left = []
    for order in (1, 2, 3):
        got = response(drive(kind, {**gains, **plant, "order": order}, sine(frequency), 5000), frequency)
        left.append(abs(got - 1.0))
        if order == 3:
            assert abs(delay(got, frequency)) < 1e-4
    assert left[0] > left[1] > left[2]
    assert left[2] < 2e-3


def test_feedback_reduces_the_error_of_a_wrong_inverse() -> None:
    wrong = {"delay": 0.010, "time_constant": 0.024}
    alone = response(drive("inverse", wrong, sine(1.0), 5000), 1.0)
    both = response(drive("pid_inverse", GAINS | wrong, sine(1.0), 5000), 1.0)
    assert abs(both - 1.0) == pytest.approx(abs(alone - 1.0) / 2.93, rel=0.1)
