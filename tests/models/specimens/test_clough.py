"""Clough's column against hand calculation: skeleton, reloading to the peak, unloading stiffness, energy."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import InputError
from models import specimens
from models.registry import Array

K, DY = 12.5e6, 0.008  # N/m, m
FORCE = K * DY
DEFORMATIONS = st.lists(st.floats(-20.0 * DY, 20.0 * DY), min_size=1, max_size=30)


def forces(path: Array | list[float], **params: float) -> Array:
    kind, p, s = specimens.pack("clough", **({"stiffness": 1.0, "yield_displacement": 1.0} | params))
    return np.array([specimens.step(kind, p, s, float(x)) for x in path])


def through(corners: list[float], steps: int) -> Array:
    parts = [np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(corners)]
    return np.concatenate([corners[:1], *parts])


def test_the_loop_without_degraded_unloading_agrees_with_a_hand_calculation() -> None:
    # yields to 3, unloads at 1 to zero force at 1.8, aims at (-1, -1), follows the skeleton to -2, back
    path = [1.0, 3.0, 2.0, 1.8, 0.4, -1.0, -2.0, -0.9, 1.05, 3.0, 4.0]
    expected = [1.0, 1.2, 0.2, 0.0, -0.5, -1.0, -1.1, 0.0, 0.6, 1.2, 1.3]
    np.testing.assert_allclose(forces(path, hardening=0.1), expected, rtol=1e-13, atol=1e-14)


def test_one_increment_may_cross_every_branch() -> None:
    # unloading, reloading and skeleton of the other side in a single call
    np.testing.assert_allclose(forces([3.0, -5.0, 6.0], hardening=0.1), [1.2, -1.4, 1.5], rtol=1e-14)


@pytest.mark.parametrize("exponent", [0.0, 0.3, 0.5, 1.0])
@pytest.mark.parametrize("ductility", [1.5, 4.0])
def test_the_unloading_stiffness_degrades_with_the_peak_deformation(
    exponent: float, ductility: float
) -> None:
    force = forces([ductility, ductility - 0.1], unloading=exponent)
    assert (force[0] - force[1]) / 0.1 == pytest.approx(ductility**-exponent, rel=1e-12)


def test_unloading_never_falls_below_the_secant() -> None:
    force = forces([5.0, 4.0], unloading=1.0, hardening=0.5)
    assert force[0] - force[1] == pytest.approx(3.0 / 5.0, rel=1e-14)


def test_reversal_before_zero_force_aims_at_the_peak_again() -> None:
    np.testing.assert_allclose(forces([3.0, 2.5, 2.75, 3.0]), [1.0, 0.5, 0.75, 1.0], rtol=1e-14)
    # on the way to the peak from (-2, 0): half way up, back by unloading, then straight to the peak
    path = [3.0, -3.0, -2.0, 0.5, 0.25, 1.625, 3.0]
    np.testing.assert_allclose(forces(path), [1.0, -1.0, 0.0, 0.5, 0.25, 0.625, 1.0], rtol=1e-14)


def test_a_crack_makes_the_skeleton_trilinear_and_the_crack_closes() -> None:
    params = {"crack_displacement": 0.2, "closing": 0.4, "hardening": 0.05}
    np.testing.assert_allclose(forces([0.1, 0.2, 1.0, 3.0], **params), [0.1, 0.2, 0.68, 0.78], rtol=1e-14)
    # below yielding the crack is a bend that stores work
    path = through([0.0, 0.9, -0.9, 0.9], 18)
    np.testing.assert_allclose(
        forces(path, **params), 0.6 * path + 0.4 * np.clip(path, -0.2, 0.2), atol=1e-14
    )


@given(
    DEFORMATIONS,
    st.floats(0.0, 0.5),
    st.floats(0.0, 1.0),
    st.floats(0.0, 0.5),
    st.integers(1, 7),
)
def test_forces_are_finite_independent_of_steps_and_never_return_work(
    corners: list[float], hardening: float, unloading: float, closing: float, steps: int
) -> None:
    params = {
        "stiffness": K,
        "yield_displacement": DY,
        "hardening": hardening,
        "unloading": unloading,
        "closing": closing,
        "crack_displacement": 0.2 * DY,
    }
    whole = forces(corners, **params)
    assert np.isfinite(whole).all()
    assert np.all(np.abs(whole) <= FORCE * (1.0 + hardening * 20.0) * (1.0 + 1e-9))
    path = through([0.0, *corners], steps)
    force = forces(path, **params)
    np.testing.assert_allclose(force[steps::steps], whole, rtol=0, atol=1e-7 * FORCE)


@given(DEFORMATIONS, st.floats(0.0, 0.5), st.floats(0.0, 1.0))
def test_the_work_of_a_clough_column_is_never_negative(
    corners: list[float], hardening: float, unloading: float
) -> None:
    path = through([0.0, *corners], 400)
    force = forces(path, stiffness=K, yield_displacement=DY, hardening=hardening, unloading=unloading)
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(path))
    # the corners between branches are cut by the steps of the sum
    assert work.min() >= -1e-3 * FORCE * DY * len(corners)


@pytest.mark.parametrize(
    ("params", "says"),
    [
        ({"closing": 0.3}, "crack_displacement"),
        ({"closing": 0.5, "crack_displacement": 0.1, "hardening": 0.6}, "at most 1"),
        ({"hardening": -0.1}, "at least 0"),
        ({"unloading": 1.5}, "at most 1"),
    ],
)
def test_parameters_that_no_column_can_have_are_refused(params: dict[str, float], says: str) -> None:
    with pytest.raises(InputError, match=says):
        forces([0.0], **params)
