"""The ticks of a controller by a logger's clock: rates, offsets and clocks that are out of step."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.registry import Array
from rths.examine.importing.controller_clock import clock_by_ground, clock_by_rows, clock_of
from rths.examine.importing.ticks import ControllerClock

INTERVAL, SECONDS = 2e-3, 12.0


def logged(rate: float, begin: float, ppm: float) -> tuple[Array, Array, Array]:
    """Times by the logger of rows that begin some time after a tick, the ticks in force and a value that is held."""
    times = np.arange(round(SECONDS * rate)) / rate
    true = begin + times / (1.0 + 1e-6 * ppm)
    ticks = np.floor(true / INTERVAL + 1e-9)
    return times, ticks, np.sin(3.0 * INTERVAL * ticks)


def off(clock: ControllerClock, begin: float, ppm: float) -> float:
    """The largest error of a tick's time, s."""
    t = np.arange(0.0, SECONDS - 0.1, INTERVAL)
    true = (t - begin) * (1.0 + 1e-6 * ppm)
    return float(np.max(np.abs(clock.ticks(t) - true)))


@settings(max_examples=40)
@given(
    st.sampled_from([512.0, 600.0, 1024.0, 1200.0, 2048.0]),
    st.floats(-0.9e-3, 0.9e-3),
    st.floats(-100.0, 100.0),
)
def test_a_clock_out_of_step_is_known_to_a_part_of_a_row(rate: float, begin: float, ppm: float) -> None:
    times, _, values = logged(rate, begin, ppm)
    found = clock_of(times, [values], INTERVAL)
    assert found is not None
    assert off(found, begin, ppm) < 0.25 / rate
    assert found.holds(times, values)


@pytest.mark.parametrize("rate", [600.0, 1000.0, 1024.0, 2000.0])
def test_a_logger_that_is_in_step_is_taken_to_be_exactly_so(rate: float) -> None:
    times, ticks, values = logged(rate, 0.0, 0.0)
    found = clock_of(times, [np.zeros(times.size), values], INTERVAL)
    assert found == ControllerClock(INTERVAL, 0.0, 0.0)
    assert not found.between
    t = INTERVAL * np.arange(ticks[-1])
    when, held = found.held(times, ticks, t)
    assert np.array_equal(when, t)
    assert np.array_equal(held, np.arange(t.size))


@pytest.mark.parametrize(("rate", "begin"), [(500.0, 1.2e-3), (1000.0, 0.3e-3), (1024.0, 0.7e-3)])
def test_the_number_of_a_message_is_that_which_was_in_force_from_its_tick_on(
    rate: float, begin: float
) -> None:
    times, ticks, _ = logged(rate, begin, 0.0)
    clock = ControllerClock(INTERVAL, -begin if rate > 500.0 else 0.0, 0.0)
    t = INTERVAL * np.arange(1.0, 5900.0)
    assert np.array_equal(clock.latest(times, ticks, t), np.arange(1.0, 5900.0))


def test_a_tick_that_a_slow_logger_passes_over_has_the_number_between_its_neighbours() -> None:
    times, ticks, _ = logged(500.0, 1.995e-3, -40.0)
    clock = ControllerClock(INTERVAL, -1.995e-3 * (1.0 - 4e-5), -4e-5)
    t = INTERVAL * np.arange(1.0, 5900.0)
    assert np.count_nonzero(np.diff(ticks) == 2.0) == 1
    assert np.array_equal(clock.latest(times, ticks, t), np.arange(1.0, 5900.0))


def test_rows_of_twice_the_rate_say_between_which_of_them_the_ticks_are() -> None:
    times, ticks, values = logged(1000.0, -0.3e-3, 0.0)
    found = clock_of(times, [values], INTERVAL)
    assert found is not None
    assert off(found, -0.3e-3, 0.0) < 0.5e-3
    t = INTERVAL * np.arange(100.0)
    assert np.array_equal(found.held(times, ticks, t)[1], np.arange(100.0))


@pytest.mark.parametrize("ppm", [-15.0, 18.0])
def test_ticks_that_drift_past_a_row_tell_the_way(ppm: float) -> None:
    begin = 1e-4 * np.sign(ppm)  # from which a tick passes a row in the middle of the test
    times, _, values = logged(1000.0, begin, ppm)
    found = clock_of(times, [values], INTERVAL)
    assert found is not None
    assert np.sign(found.fast) == np.sign(ppm)
    assert off(found, begin, ppm) < 0.35e-3


@pytest.mark.parametrize("ppm", [-55.0, 45.0])
def test_ticks_that_pass_two_rows_of_twice_the_rate_tell_how_fast_the_clock_is(ppm: float) -> None:
    times = np.arange(40_000) / 1000.0
    ticks = np.floor((3e-4 + times / (1.0 + 1e-6 * ppm)) / INTERVAL)
    found = clock_of(times, [np.sin(3.0 * INTERVAL * ticks)], INTERVAL)
    assert found is not None
    assert found.fast == pytest.approx(1e-6 * ppm, abs=6e-6)


def test_rows_that_ticks_pass_for_a_long_time_tell_as_well() -> None:
    times, _, values = logged(600.0, 0.4e-3, 40.0)  # of five rows one is just before a tick, for seconds
    found = clock_of(times, [values], INTERVAL)
    assert found is not None
    assert off(found, 0.4e-3, 40.0) < 0.25 / 600.0


def test_a_rate_that_bounds_leave_open_is_told_with_its_error() -> None:
    times, _, values = logged(600.0, 0.1e-3, 40.0)
    found = clock_of(times, [values], INTERVAL)
    assert found is not None
    assert abs(found.fast - 40e-6) < found.unsure < 40e-6
    assert f"± {1e6 * found.unsure:.0f} ppm" in found.told
    assert "±" not in found._replace(unsure=1e-6).told


def test_smooth_and_rounded_and_slow_channels_tell_nothing() -> None:
    times, _, values = logged(1024.0, 0.4e-3, 0.0)
    smooth: Array = np.sin(3.0 * times)
    rounded: Array = np.round(smooth, 2)
    assert clock_of(times, [smooth, rounded, np.zeros(times.size)], INTERVAL) is None
    assert clock_of(times[::4], [values[::4]], INTERVAL) is None
    found = clock_of(times, [values], INTERVAL)
    assert found is not None
    assert not found.holds(times, smooth)
    assert not found.holds(times, rounded)


def test_times_that_are_rounded_to_a_tenth_of_a_millisecond_do() -> None:
    times, _, values = logged(1024.0, 0.5e-3, 20.0)
    found = clock_of(np.round(times, 4), [values], INTERVAL)
    assert found is not None
    assert off(found, 0.5e-3, 20.0) < 0.1e-3


GROUND = np.sin(2.0 * np.pi * np.array([[0.7], [1.9]]) * INTERVAL * np.arange(6100.0)).sum(axis=0)


def by_ground(rate: float, begin: float, ppm: float) -> tuple[Array, Array, ControllerClock | None]:
    """Times of rows, the ticks in force and the clock that a recorded ground motion tells."""
    times, ticks, _ = logged(rate, begin, ppm)
    seen = ticks.clip(0).astype(int)
    return times, ticks, clock_by_ground(times, np.round(GROUND[seen], 7), GROUND, INTERVAL)


@settings(max_examples=25)
@given(st.sampled_from([256.0, 600.0, 1024.0]), st.floats(0.0, 3.5e-3), st.floats(-60.0, 60.0))
def test_the_ground_tells_the_ticks_at_any_rate(rate: float, begin: float, ppm: float) -> None:
    _, _, found = by_ground(rate, begin, ppm)
    assert found is not None
    assert off(found, begin, ppm) < 0.3e-3


def test_the_first_row_of_a_slow_logger_may_be_three_ticks_behind_the_first_tick() -> None:
    _, _, found = by_ground(200.0, 6.3e-3, 30.0)
    assert found is not None
    assert off(found, 6.3e-3, 30.0) < 0.4e-3


@pytest.mark.parametrize("ppm", [-30.0, 30.0])
def test_a_logger_of_the_controller_s_own_rate_shows_where_a_tick_passes_a_row(ppm: float) -> None:
    begin = 2e-4 if ppm > 0.0 else INTERVAL - 2e-4
    times, ticks, found = by_ground(1.0 / INTERVAL, begin, ppm)
    assert found is not None
    assert np.count_nonzero(np.diff(ticks) != 1.0) == 1
    assert np.sign(found.fast) == np.sign(ppm)
    t = INTERVAL * np.arange(1.0, 5990.0)
    seen, values = found.seen(times, GROUND[ticks.astype(int)])
    assert np.array_equal(values, GROUND[np.round(seen / INTERVAL).astype(int)])
    assert np.setdiff1d(t, seen).size <= 1  # a tick has no row where the logger is slow


@pytest.mark.parametrize("rate", [50.0, 1024.0])
def test_a_clock_that_gains_many_ticks_is_followed(rate: float) -> None:
    times = np.arange(round(200.0 * rate)) / rate
    ticks = np.floor((times / (1.0 - 8e-5) + 1e-4) / INTERVAL).astype(int)
    ground = np.sin(2.0 * np.pi * np.array([[0.7], [1.9]]) * INTERVAL * np.arange(101_000.0)).sum(axis=0)
    found = clock_by_ground(times, ground[ticks], ground, INTERVAL)
    assert found is not None
    assert found.fast == pytest.approx(-8e-5, abs=5e-6)  # eight ticks in all


def test_a_logger_of_the_controller_s_own_rate_that_is_in_step_stays_as_it_is() -> None:
    times, ticks, found = by_ground(1.0 / INTERVAL, 1.3e-3, 0.0)
    assert found == ControllerClock(INTERVAL, 0.0, 0.0)
    assert found is not None
    seen, values = found.seen(times, ticks)
    assert np.array_equal(values, ticks)
    assert np.array_equal(seen, INTERVAL * ticks)


def test_rows_of_a_slower_logger_stand_at_their_ticks() -> None:
    times, ticks, found = by_ground(200.0, 0.3e-3, 0.0)
    assert found is not None
    seen, values = found.seen(times, GROUND[ticks.astype(int)])
    assert np.array_equal(values, GROUND[np.round(seen / INTERVAL).astype(int)])
    assert np.max(np.abs(seen - times)) > 0.4 * INTERVAL


def test_a_single_row_that_may_be_either_side_of_a_tick_is_left_out() -> None:
    times, ticks, found = by_ground(256.0, 0.3e-3, 20.0)
    assert found is not None
    for late in (-3e-6, 3e-6):  # by which the clock is known
        off = found._replace(begin=found.begin + late)
        seen, values = off.seen(times, GROUND[ticks.astype(int)])
        assert np.array_equal(values, GROUND[np.round(seen / INTERVAL).astype(int)])
        assert seen.size > 0.97 * times.size


def test_a_ground_that_is_no_number_of_the_controller_tells_nothing() -> None:
    times, _, _ = logged(1024.0, 0.3e-3, 0.0)
    true = np.interp(times + 0.3e-3, INTERVAL * np.arange(GROUND.size), GROUND)
    assert clock_by_ground(times, true, GROUND, INTERVAL) is None
    noise = np.random.default_rng(3).normal(0.0, 1e-2, times.size)
    assert clock_by_ground(times, true + noise, GROUND, INTERVAL) is None
    assert clock_by_ground(times, np.zeros(times.size), GROUND, INTERVAL) is None


def test_the_ground_says_which_tick_is_the_first() -> None:
    times, _, values = logged(1024.0, 1.7e-3, 0.0)
    alone = clock_of(times, [values], INTERVAL)
    _, _, ground = by_ground(1024.0, 1.7e-3, 0.0)
    assert alone is not None
    assert ground is not None
    assert alone.begin == pytest.approx(0.3e-3, abs=2e-5)
    both = clock_of(times, [values], INTERVAL, ground)
    assert both is not None
    assert both.begin == pytest.approx(-1.7e-3, abs=2e-5)


@settings(max_examples=25)
@given(st.sampled_from([1000.0, 2000.0]), st.floats(0.0, 1.9e-3), st.floats(-60.0, 60.0))
def test_ticks_that_pass_the_rows_of_twice_the_rate_are_followed_the_way_that_the_ground_says(
    rate: float, begin: float, ppm: float
) -> None:
    times, _, values = logged(rate, begin, ppm)
    _, _, ground = by_ground(rate, begin, ppm)
    assert ground is not None
    found = clock_of(times, [values], INTERVAL, ground)
    assert found is not None
    assert off(found, begin, ppm) < 1.0 / rate


@pytest.mark.parametrize("first", [0, 2])
def test_rows_of_the_controller_s_own_between_those_of_a_logger_are_its_ticks(first: int) -> None:
    ticks = np.delete(np.arange(3000), [40, 41, 1700])
    times = np.round(0.0013 + (1.0 + 8e-5) * INTERVAL * ticks, 6)
    found = clock_by_rows(times, INTERVAL, GROUND[first + ticks], GROUND)
    assert found is not None
    assert found.fast == pytest.approx(8e-5, abs=1e-7)
    assert found.begin == pytest.approx(0.0013 - first * INTERVAL * (1.0 + 8e-5), abs=1e-6)
    seen, values = found.seen(times, GROUND[first + ticks])
    assert np.array_equal(np.rint(seen / INTERVAL), first + ticks)
    assert np.array_equal(values, GROUND[first + ticks])


def test_rows_that_jitter_or_have_another_rate_are_no_ticks() -> None:
    times = INTERVAL * np.arange(3000.0)
    jitter = 0.1 * INTERVAL * np.random.default_rng(5).uniform(-1.0, 1.0, times.size)
    assert clock_by_rows(times + jitter, INTERVAL) is None
    assert clock_by_rows(1.002 * times, INTERVAL) is None
    assert clock_by_rows(times[:30], INTERVAL) is None


def test_a_row_just_before_a_tick_that_drifts_past_it_belongs_to_the_tick_before() -> None:
    """Rows come 10 µs before their tick at first, which is half a hundredth of an interval, and 50 µs at the end."""
    clock = ControllerClock(INTERVAL, 10e-6, 40e-6 / SECONDS)
    times = INTERVAL * np.arange(round(SECONDS / INTERVAL), dtype=np.float64)
    ticks = np.floor(clock.places(times))
    when, values = clock.held(times, ticks, INTERVAL * np.arange(100, dtype=np.float64))
    assert values == pytest.approx(when / INTERVAL)
