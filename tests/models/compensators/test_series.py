"""The power series with given coefficients."""

from __future__ import annotations

import numpy as np
import pytest

from common.plan.laboratory_tables import ServoHydraulics
from models import compensators
from models.compensators import inverse
from models.transfer_systems import servo_hydraulic
from tests.models.compensators.rig import DT, ask


def test_the_command_is_the_sum_of_its_terms() -> None:
    given = {"a0": 1.25, "a1": 0.5, "a2": 0.125, "a3": 0.0625}
    built = compensators.build("series", given, DT)
    assert ask(built, 1.0, 2.0, -4.0, 8.0) == 1.25 + 1.0 - 0.5 + 0.5


def test_the_series_of_a_lag_inverts_that_lag() -> None:
    c = inverse.coefficients(0.014, 0.03, 0.8, 3.0)
    fixed = compensators.build("series", {f"a{i}": float(c[i]) for i in range(4)}, DT)
    other = compensators.build(
        "inverse", {"delay": 0.014, "time_constant": 0.03, "gain": 0.8, "order": 3}, DT
    )
    numbers = (0.1, -2.0, 30.0, 400.0)
    assert ask(fixed, *numbers) == ask(other, *numbers)


@pytest.mark.parametrize("frequency", [0.5, 2.0, 5.0, 10.0])
def test_the_default_series_inverts_the_plant_of_the_benchmark(frequency: float) -> None:
    """Against the response of the servo-hydraulics with the benchmark's specimen."""
    a, b = servo_hydraulic.rates(ServoHydraulics(), 1.19e6, 114.6, 29.13, 0.0)
    s = 2j * np.pi * frequency
    position = np.linalg.solve(s * np.eye(servo_hydraulic.STATES) - a, b[:, 0])[servo_hydraulic.POSITION]
    built = compensators.build("series", {}, DT)
    series = sum(built.params[i] * s**i for i in range(4))
    assert abs(position * series - 1.0) < 6e-3
