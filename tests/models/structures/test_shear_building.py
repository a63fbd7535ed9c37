"""Shear building against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from common.errors import InputError
from models.structures import shear_building


def test_the_seed_papers_building_has_its_period_and_damping_ratio() -> None:
    M, C, K = shear_building.matrices(np.array([160_000.0]), np.array([25e6]), np.array([200_000.0]))
    modes = shear_building.modes(M, C, K)
    assert modes.periods[0] == pytest.approx(0.5027, abs=5e-5)
    assert modes.periods[0] == pytest.approx(2 * math.pi * math.sqrt(160_000.0 / 25e6), rel=1e-14)
    assert modes.damping_ratios[0] == pytest.approx(0.05, rel=1e-14)
    assert modes.shapes[0, 0] ** 2 * 160_000.0 == pytest.approx(1.0)


@pytest.mark.parametrize("n", [1, 2, 3, 7, 20])
def test_uniform_building_has_the_closed_form_frequencies(n: int) -> None:
    m, k, c = 2e5, 3e8, 4e5
    M, C, K = shear_building.matrices(np.full(n, m), np.full(n, k), np.full(n, c))
    modes = shear_building.modes(M, C, K)
    j = np.arange(1, n + 1)
    omega = 2.0 * math.sqrt(k / m) * np.sin((2 * j - 1) * math.pi / (2 * (2 * n + 1)))
    np.testing.assert_allclose(2.0 * math.pi / modes.periods, omega, rtol=1e-11)
    # dashpots in proportion to the springs damp each mode in proportion to its frequency
    np.testing.assert_allclose(modes.damping_ratios, 0.5 * c / k * omega, rtol=1e-11)
    np.testing.assert_allclose(modes.shapes.T @ M @ modes.shapes, np.eye(n), atol=1e-12)


def test_matrices_equal_the_sum_of_the_storeys() -> None:
    generator = np.random.default_rng(3)
    n = 5
    mass, stiffness, damping = generator.uniform(1.0, 2.0, (3, n))
    M, C, K = shear_building.matrices(mass, stiffness, damping)
    x = generator.standard_normal(n)
    spring, dashpot = np.zeros(n), np.zeros(n)
    for i in range(n):
        drift = shear_building.storey_drift(x, i)
        shear_building.add_nodal(stiffness[i] * drift, i, spring)
        shear_building.add_nodal(damping[i] * drift, i, dashpot)
    np.testing.assert_allclose(spring, K @ x, rtol=1e-12)
    np.testing.assert_allclose(dashpot, C @ x, rtol=1e-12)
    np.testing.assert_array_equal(M, np.diag(mass))
    # the shears add up to the base shear
    assert spring.sum() == pytest.approx(stiffness[0] * x[0])


def test_drift_and_nodal_force_of_each_storey_are_computed() -> None:
    x = np.array([1.0, 3.0, 7.0])
    assert [shear_building.storey_drift(x, i) for i in range(3)] == [1.0, 2.0, 4.0]
    out = np.zeros(3)
    shear_building.add_nodal(5.0, 0, out)
    shear_building.add_nodal(7.0, 2, out)
    assert out.tolist() == [5.0, -7.0, 7.0]


def test_a_rigid_mode_has_no_period() -> None:
    M, C, K = shear_building.matrices(np.ones(2), np.array([0.0, 4.0]), np.zeros(2))
    modes = shear_building.modes(M, C, K)
    assert math.isinf(modes.periods[0])
    assert math.isnan(modes.damping_ratios[0])
    assert modes.periods[1] == pytest.approx(2 * math.pi / math.sqrt(8.0))


@pytest.mark.parametrize(
    ("mass", "stiffness", "damping"),
    [
        ([1.0], [1.0, 1.0], [1.0]),
        ([], [], []),
        ([0.0], [1.0], [1.0]),
        ([1.0], [-1.0], [1.0]),
        ([1.0], [1.0], [math.nan]),
        ([math.inf], [1.0], [1.0]),
    ],
)
def test_impossible_storeys_are_refused(
    mass: list[float], stiffness: list[float], damping: list[float]
) -> None:
    with pytest.raises(InputError, match=r"must be|give one value"):
        shear_building.matrices(np.array(mass), np.array(stiffness), np.array(damping))
