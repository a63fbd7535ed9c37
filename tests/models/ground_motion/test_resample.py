from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from models.ground_motion import MOTIONS, GroundMotion, ground, ground_displacement, load, resample
from models.ground_motion.resample import integrate

Array = NDArray[np.float64]
INTERVAL = 0.002  # s

samples = st.lists(st.floats(-10.0, 10.0), min_size=2, max_size=60).map(np.array)


def motion(values: Array, interval: float = 0.02) -> GroundMotion:
    return GroundMotion("Test", "test", interval, values)


def second_difference(displacement: Array, interval: float = INTERVAL) -> Array:
    return np.diff(displacement, 2) / interval**2


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


@settings(deadline=None)
@given(values=samples, ratio=st.integers(1, 12))
def test_resampling_keeps_the_original_samples_and_joins_them_by_lines(values: Array, ratio: int) -> None:
    interval = 0.02 / ratio
    got = resample(motion(values), interval, 0.02 * (values.size - 1))
    assert got.size == ratio * (values.size - 1) + 1
    np.testing.assert_allclose(got[::ratio], values, rtol=0.0, atol=1e-10)
    for j in range(1, ratio):
        expected = values[:-1] + j / ratio * np.diff(values)
        np.testing.assert_allclose(got[j::ratio], expected, rtol=0.0, atol=1e-10)


def test_intervals_that_do_not_divide_each_other_are_interpolated() -> None:
    got = resample(motion(np.array([0.0, 3.0, -3.0]), 0.03), 0.02, 0.06)
    np.testing.assert_allclose(got, [0.0, 2.0, 1.0, -3.0], atol=1e-12)


def test_the_motion_ends_at_zero_within_one_interval_of_the_record() -> None:
    got = resample(motion(np.array([1.0, 2.0])), 0.005, 0.06)
    np.testing.assert_allclose(got, [1, 1.25, 1.5, 1.75, 2, 1.5, 1, 0.5, 0, 0, 0, 0, 0], atol=1e-12)


@settings(deadline=None)
@given(values=samples, duration=st.floats(0.0, 3.0))
def test_the_resampled_motion_has_the_length_of_the_test(values: Array, duration: float) -> None:
    got = resample(motion(values), INTERVAL, duration)
    assert got.size == round(duration / INTERVAL) + 1
    assert np.abs(got).max() <= np.abs(values).max()
    assert not got[int((values.size + 1) * 0.02 / INTERVAL) :].any()


@settings(deadline=None)
@given(values=samples)
def test_the_integration_is_exact_for_straight_lines(values: Array) -> None:
    times = 0.1 * np.arange(values.size)
    lines = PPoly(np.stack([np.diff(values) / 0.1, values[:-1]]), times)
    velocity, displacement = integrate(values, 0.1)
    np.testing.assert_allclose(velocity, lines.antiderivative(1)(times), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(displacement, lines.antiderivative(2)(times), rtol=0.0, atol=1e-9)


def test_the_displacement_agrees_with_the_closed_form_of_a_wave_train() -> None:
    amplitude, omega, length = 0.05, 2.0 * np.pi * 1.5, 20.0  # m, rad/s, s
    t = np.linspace(0.0, length, round(length / INTERVAL) + 1)
    slow = np.pi / length
    window, slope, bend = (
        np.sin(slow * t) ** 2,
        slow * np.sin(2 * slow * t),
        2 * slow**2 * np.cos(2 * slow * t),
    )
    wave, quadrature = np.sin(omega * t), np.cos(omega * t)
    exact = amplitude * window * wave
    acceleration = amplitude * ((bend - omega**2 * window) * wave + 2.0 * omega * slope * quadrature)
    got = ground_displacement(np.append(acceleration, np.zeros(1000)), INTERVAL)
    np.testing.assert_allclose(got[: t.size], exact, rtol=0.0, atol=1e-4 * amplitude)
    assert not got[t.size :].any()


@settings(deadline=None)
@given(offset=st.floats(-1.0, 1.0), slope=st.floats(-0.1, 0.1))
def test_an_acceleration_of_drift_only_gives_no_displacement(offset: float, slope: float) -> None:
    got = ground_displacement(np.linspace(offset, offset + 10.0 * slope, 5001), INTERVAL)
    np.testing.assert_allclose(got, 0.0, atol=1e-11)


@pytest.mark.parametrize("order", range(5))
def test_drift_added_to_a_record_does_not_change_its_displacement(order: int, tmp_path: Path) -> None:
    record = load("el_centro_1940_ns", tmp_path).acceleration
    fine = resample(motion(record), INTERVAL, 31.18)
    s = np.linspace(0.0, 1.0, fine.size)
    with_drift = ground_displacement(fine + 0.05 * s**order, INTERVAL)
    np.testing.assert_allclose(with_drift, ground_displacement(fine, INTERVAL), rtol=0.0, atol=1e-6)


@settings(deadline=None)
@given(values=samples, quiet=st.integers(1, 300))
def test_a_corrected_motion_begins_and_ends_at_rest(values: Array, quiet: int) -> None:
    moving = round((values.size + 1) * 0.02 / INTERVAL)
    acceleration = resample(motion(values), INTERVAL, (moving + quiet) * INTERVAL)
    got = ground_displacement(acceleration, INTERVAL)
    assert got[0] == 0.0
    assert not got[moving:].any()
    added = (integrate(acceleration, INTERVAL)[1] - got)[: np.flatnonzero(acceleration).max(initial=-1) + 2]
    s = np.linspace(-1.0, 1.0, added.size)
    if added.size > 7:
        fit = np.polynomial.Polynomial.fit(s, added, 6, domain=[-1.0, 1.0])
        np.testing.assert_allclose(fit(s), added, rtol=0.0, atol=1e-9)
        assert fit(-1.0) == pytest.approx(0.0, abs=1e-9)
        assert fit.deriv()(-1.0) == pytest.approx(0.0, abs=1e-7)


def test_no_acceleration_gives_no_displacement() -> None:
    assert not ground_displacement(np.zeros(10), INTERVAL).any()
    np.testing.assert_array_equal(ground_displacement(np.ones(1), INTERVAL), [0.0])


@pytest.mark.parametrize("name", MOTIONS)
def test_the_second_difference_stays_close_to_the_record(name: str, tmp_path: Path) -> None:
    record = load(name, tmp_path)
    acceleration, displacement = ground(record, INTERVAL, record.duration + 15.0)
    curvature = second_difference(displacement)
    error = rms(curvature - acceleration[1:-1]) / rms(acceleration)
    print(f"{name}: displacement {np.abs(displacement).max():.3f} m, difference {100 * error:.2f} % rms")
    assert error < 0.01


@pytest.mark.parametrize("name", MOTIONS)
def test_the_displacement_has_no_step_or_kink(name: str, tmp_path: Path) -> None:
    record = load(name, tmp_path)
    acceleration, displacement = ground(record, INTERVAL, record.duration + 15.0)
    # a step of 1 mm would be a curvature of 250 m/s², a kink of 10 mm/s one of 5 m/s² beside the record's own
    added = second_difference(displacement) - acceleration[1:-1]
    corners = (
        np.abs(np.diff(acceleration, 2)).max() / 6.0
    )  # the second difference rounds the record's corners
    assert np.abs(added).max() < corners + 0.01 * record.peak
    assert np.abs(second_difference(displacement)).max() <= 1.01 * record.peak
    assert not displacement[round((record.duration + record.interval) / INTERVAL) + 1 :].any()


def test_el_centro_at_full_scale_moves_as_far_as_published(tmp_path: Path) -> None:
    displacement = ground(load("el_centro_1940_ns", tmp_path), INTERVAL, 40.0)[1]
    assert np.abs(displacement).max() == pytest.approx(0.190, abs=0.001)  # published: 0.109 m to 0.213 m


@pytest.mark.parametrize("duration", [2.0, 10.0, 31.2, 40.0, 90.0])
def test_the_displacement_does_not_depend_on_the_length_of_the_test(duration: float, tmp_path: Path) -> None:
    record = load("el_centro_1940_ns", tmp_path)
    rows = ground(record, INTERVAL, duration)
    assert rows.shape == (2, round(duration / INTERVAL) + 1)
    np.testing.assert_array_equal(rows[0], resample(record, INTERVAL, duration))
    longest = ground(record, INTERVAL, 90.0)[:, : rows.shape[1]]
    np.testing.assert_allclose(rows, longest, rtol=0.0, atol=1e-12)


def test_the_displacement_scales_with_the_record(tmp_path: Path) -> None:
    record = load("el_centro_1940_ns", tmp_path)
    full = ground(record, INTERVAL, 35.0)
    np.testing.assert_allclose(ground(record.scaled(0.1), INTERVAL, 35.0), 0.1 * full, rtol=1e-9, atol=1e-12)
