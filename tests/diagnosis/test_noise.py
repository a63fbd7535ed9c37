"""The step to which readings are rounded."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from common.errors import InputError
from common.recording.imported import ImportedChannel
from common.recording.logger.low_pass import LoggerFilter
from diagnosis.signals.noise import level
from diagnosis.signals.noise.rounding import quantum, quantum_between
from models.registry import Array


@pytest.mark.parametrize("n", [1, 5, 9, 50, 2000])
def test_a_constant_reading_has_no_quantum(n: int) -> None:
    assert quantum(np.full(n, 3.3)) == 0.0


def test_readings_that_are_not_finite_are_refused() -> None:
    with pytest.raises(InputError):
        quantum(np.array([]))


@given(
    step=st.floats(1e-9, 1e3),
    offset=st.floats(-50.0, 50.0),
    spread=st.floats(1.0, 3000.0),
    seed=st.integers(0, 99),
)
def test_the_quantum_of_rounded_noise_is_found(step: float, offset: float, spread: float, seed: int) -> None:
    places = np.round(np.random.default_rng(seed).normal(0.0, spread, 2000))
    gap = float(np.gcd.reduce(np.diff(np.unique(places)).astype(np.int64)))
    assert quantum(places * step + offset * step) == pytest.approx(gap * step, rel=1e-9)


def test_the_quantum_is_found_although_levels_are_missing() -> None:
    assert quantum(0.1 * np.array([0.0, 2.0, 2.0, 5.0, 9.0])) == pytest.approx(0.1)
    assert quantum(0.3 * np.array([6.0, 10.0, 21.0, 1000.0])) == pytest.approx(0.3)
    assert quantum(np.array([1.0, 1.0, 4.0])) == pytest.approx(3.0)
    assert quantum(np.sin(np.arange(5000) * 0.01)) == 0.0
    assert quantum(np.concatenate([np.zeros(900), np.random.default_rng(0).random(100)])) == 0.0


@given(
    step=st.floats(1e-9, 1e3),
    digits=st.integers(8, 12),
    offset=st.floats(-1.0, 1.0),
    seed=st.integers(0, 99),
)
@example(step=0.125, digits=8, offset=0.125, seed=0)  # the text has a step of its own
def test_the_quantum_of_a_converter_is_found_in_text_of_a_few_digits(
    step: float, digits: int, offset: float, seed: int
) -> None:
    places = np.round(np.random.default_rng(seed).normal(0.0, 300.0, 6000))
    values = np.array([float(f"{value:.{digits}g}") for value in (step * (places + offset)).tolist()])
    assert quantum(values) == pytest.approx(step, rel=1e-6)
    assert quantum(1e-3 * values) == pytest.approx(1e-3 * step, rel=1e-6)


@given(seed=st.integers(0, 99), levels=st.integers(3, 3000))
def test_free_readings_that_recur_have_no_quantum(seed: int, levels: int) -> None:
    rng = np.random.default_rng(seed)
    assert quantum(rng.choice(rng.normal(size=levels), 8000)) == 0.0


@given(
    step=st.floats(1e-9, 1e3),
    rate=st.floats(700.0, 1500.0),
    amplitude=st.floats(2.0, 300.0),
    seed=st.integers(0, 99),
)
def test_the_quantum_of_readings_that_were_interpolated_after_rounding_is_found(
    step: float, rate: float, amplitude: float, seed: int
) -> None:
    times, ticks = np.arange(0.0, 12.0, 1.0 / rate), np.arange(0.0, 11.9, 0.002)
    noise = np.random.default_rng(seed).normal(0.0, 0.2, times.size)
    levels = step * np.round(amplitude * np.sin(2.0 * np.pi * 0.7 * times) + noise)
    assert quantum_between(np.interp(ticks, times, levels)) == pytest.approx(step, rel=1e-6)


def test_repeated_readings_that_were_never_rounded_have_no_quantum() -> None:
    values = np.random.default_rng(1).normal(size=4000)
    values[7::20] = values[6::20]
    assert quantum_between(values) == 0.0
    assert quantum_between(np.full(4000, 2.0)) == 0.0


def heavy(seed: int, *shape: int) -> Array:
    """Noise of rms one whose tails are those of Student's t with four degrees of freedom."""
    return np.random.default_rng(seed).standard_t(4, shape) / np.sqrt(2.0)


def test_tails_that_all_readings_share_count_with_the_level_of_their_noise() -> None:
    assert level.white_rms(heavy(1, 6000, 3)) == pytest.approx(np.ones(3), abs=0.08)


def test_tails_of_some_readings_only_may_be_impacts() -> None:
    normal = np.random.default_rng(2).standard_normal((6000, 1))
    found = level.white_rms(np.hstack([heavy(3, 6000, 1), normal]))
    assert found[0] < 0.9
    assert found[1] == pytest.approx(1.0, abs=0.04)


def test_tails_of_a_single_reading_may_be_the_bends_of_its_motion() -> None:
    assert level.tails(np.abs(heavy(4, 6000, 2))) > 1.05
    assert level.tails(np.abs(heavy(4, 6000, 1))) == 1.0


def test_a_motion_that_grows_has_no_tails() -> None:
    t = np.linspace(0.0, 12.0, 6000)
    motion = (np.exp(0.5 * t) * np.sin(12.0 * t))[:, None]
    assert level.tails(np.abs(np.diff(motion, n=4, axis=0))) == 1.0


@pytest.mark.parametrize("hidden", [0.06, 0.14, 0.2])
def test_the_error_of_steps_is_no_louder_than_its_rms(hidden: float) -> None:
    t = np.arange(6000) * 0.002
    motion = 150.0 * np.sin(2.0 * np.pi * 0.4 * t) + np.random.default_rng(3).normal(0.0, hidden, t.size)
    error = np.round(motion) - motion
    found = level.white_rms(np.stack([error, error], axis=1))
    assert found == pytest.approx(np.sqrt(1.0 / 12.0), rel=0.25)


@pytest.mark.parametrize(
    ("kind", "order", "cutoff", "size"),
    [("bessel", 3, 156.0, 2), ("butterworth", 4, 100.0, 3), ("bessel", 2, 40.0, 7)],
)
def test_what_a_filter_took_of_noise_below_its_cutoff_is_known(
    kind: str, order: int, cutoff: float, size: int
) -> None:
    """White noise through the filter ten times as fast as the ticks, whose level at rest is one."""
    interval, times = 0.002, 10
    passed = LoggerFilter(kind, order, cutoff)
    noise = np.random.default_rng(4).standard_normal(60000 * times) * np.sqrt(times)
    frequencies: Array = np.asarray(np.fft.rfftfreq(noise.size, interval / times), dtype=np.float64)
    lines = np.asarray(np.fft.rfft(noise)) * passed.response(frequencies)
    ticks = np.fft.irfft(lines, noise.size)[::times]
    sums = ticks[: ticks.size // size * size].reshape(-1, size).sum(axis=1) / np.sqrt(size)
    (found,) = level.left_behind([ImportedChannel(passed)], [size], interval)
    assert level.white_rms(sums[:, None])[0] == pytest.approx(found, rel=0.03)
    assert found < 0.9


def test_noise_that_passed_no_filter_is_all_there() -> None:
    found = level.left_behind([ImportedChannel(), ImportedChannel(delay=0.01)], [1, 3], 0.002)
    assert found == pytest.approx([1.0, 1.0])


def test_noise_that_is_measured_where_a_filter_leaves_none_is_made_twice_as_loud_at_most() -> None:
    passed = ImportedChannel(LoggerFilter("butterworth", 4, 5.0))
    assert level.left_behind([passed], [1], 0.002) == pytest.approx([0.5])
