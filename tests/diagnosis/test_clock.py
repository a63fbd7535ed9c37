"""The clock of readings that runs at a rate of its own."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diagnosis.diagnose import examine
from diagnosis.findings.logged import logger
from diagnosis.recorded.record import Record
from diagnosis.signals import clock
from diagnosis.signals.noise.rounding import quantum_between
from models.registry import Array
from tests.diagnosis.cases import Cases, imported

INTERVAL = 0.002
TICKS = 10_000
TIME: Array = INTERVAL * np.arange(TICKS, dtype=np.float64)
THERE = np.ones(TICKS, dtype=bool)
FAST = 50e-6


def motion(t: Array) -> Array:
    """A motion with content up to 20 Hz."""
    return sum((np.sin(2.0 * np.pi * f * t + f) / f for f in (0.7, 2.3, 6.1, 20.0)), np.zeros_like(t))


def fast(values: Array) -> Array:
    """A reading as a clock that is fast takes it."""
    return clock.put_right(values, -FAST, stepped=False)


@given(
    rate=st.floats(-2e-4, 2e-4),
    late=st.floats(-2e-3, 2e-3),
    gain=st.floats(0.95, 1.05),
    seed=st.integers(0, 99),
)
def test_a_rate_is_found_beside_a_delay_a_gain_and_an_offset(
    rate: float, late: float, gain: float, seed: int
) -> None:
    noise = np.random.default_rng(seed).normal(0.0, 1e-3, TICKS)
    read = 0.02 + gain * motion((TIME - late) * (1.0 + rate)) + noise
    found = clock.rate(read, motion(TIME), THERE, INTERVAL)
    assert found is not None
    assert found.fast == pytest.approx(rate, abs=5.0 * found.error + 0.06 * abs(rate) + 1e-7)
    assert found.error < 5e-6


def test_a_reading_that_stands_still_tells_no_rate() -> None:
    assert clock.rate(motion(TIME), 0.0 * TIME, THERE, INTERVAL) is None
    assert clock.rate(motion(TIME), motion(TIME), ~THERE, INTERVAL) is None


def test_only_laboratories_that_agree_tell_a_rate() -> None:
    sure, other = clock.Rate(FAST, 2e-6), clock.Rate(-FAST, 2e-6)
    unsure = clock.Rate(0.0, 1e-3)
    assert clock.common([[sure, unsure], [sure]]) == pytest.approx(FAST, rel=0.01)
    assert clock.common([[sure, sure]]) == pytest.approx(FAST, rel=0.01)
    assert clock.common([[sure], []]) == 0.0
    assert clock.common([[sure, clock.Rate(-1e-6, 1e-4)]]) == 0.0
    assert clock.common([[clock.Rate(FAST, 1e-5), clock.Rate(FAST, 5e-5)]]) == 0.0
    assert clock.common([[clock.Rate(8e-5, 2e-6), clock.Rate(8e-5, 2e-6)]]) == 0.0
    assert clock.common([[sure], [other]]) == 0.0
    assert clock.common([[sure], [unsure]]) == 0.0
    assert clock.common([[sure, other], [sure]]) == 0.0
    assert clock.common([[clock.Rate(0.01, 1e-6)], [clock.Rate(0.01, 1e-6)]]) == 0.0


def test_rates_that_agree_but_for_a_model_that_errs_tell_one() -> None:
    column = [clock.Rate(58.7e-6, 2.2e-6), clock.Rate(51.6e-6, 3.0e-6)]
    damper = [clock.Rate(60.2e-6, 1.9e-6), clock.Rate(56.3e-6, 3.9e-6), clock.Rate(70.6e-6, 2.0e-6)]
    assert clock.common([column, damper]) == pytest.approx(60e-6, rel=0.05)
    warming = [clock.Rate(5e-6, 2.2e-6), clock.Rate(7e-6, 3.0e-6)]
    assert clock.common([warming, damper]) == 0.0


def test_a_rate_that_quartzes_err_by_needs_less_to_be_believed() -> None:
    usual, rare = (([clock.Rate(fast, 5e-6)], [clock.Rate(fast, 12e-6)]) for fast in (30e-6, 200e-6))
    assert clock.common(usual) == pytest.approx(30e-6)
    assert clock.common(rare) == pytest.approx(200e-6)
    assert clock.common([usual[0], [clock.Rate(15e-6, 12e-6)]]) == 0.0
    assert clock.common([rare[0], [clock.Rate(200e-6, 80e-6)]]) == 0.0


def test_a_reading_is_put_onto_the_clock_of_the_ticks() -> None:
    found = clock.put_right(motion(TIME * (1.0 + FAST)), FAST, stepped=False)
    inner = slice(clock.TAPS, -clock.TAPS)
    assert np.max(np.abs(found - motion(TIME))[inner]) < 3e-5
    noise = np.random.default_rng(0).normal(size=TICKS)
    assert np.std(clock.put_right(noise, FAST, stepped=False)) == pytest.approx(np.std(noise), rel=0.03)


def test_steps_of_a_reading_stay_where_neighbours_are_equal() -> None:
    step = 0.05
    read = step * np.round(motion(TIME) / step)
    assert quantum_between(clock.put_right(read, FAST, stepped=True)) == pytest.approx(step, rel=1e-9)


@pytest.mark.long
def test_a_fast_clock_is_said_and_is_no_effect(cases: Cases) -> None:
    found = examine(logger.clocked(imported(cases.record(), fast)))
    assert found.record.fast == pytest.approx(FAST, rel=0.2)
    assert {verdict.outcome for verdict in found.verdicts} <= {"none", "tolerances"}
    assert [text for text in found.warnings if "The clock of the readings is fast" in text]


@pytest.mark.long
@pytest.mark.parametrize(
    "effects",
    [{}, {"column.friction": {"force": 900.0}}, {"actuator.delay": {"delay": 6e-3}}],
    ids=["clean", "friction", "delay"],
)
def test_a_right_clock_is_left_alone(cases: Cases, effects: dict[str, dict[str, float]]) -> None:
    whole: Record = imported(cases.record(effects))
    assert logger.clocked(whole) is whole


def test_what_rths_recorded_itself_has_one_clock(cases: Cases) -> None:
    whole = cases.record()
    assert logger.clocked(whole) is whole
