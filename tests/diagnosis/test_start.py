"""When a data logger began against the plan's ground motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diagnosis.diagnose import examine, put_right
from diagnosis.findings.logged import start
from diagnosis.recorded.record import Record
from tests.diagnosis.cases import Cases, imported

TICKS = 5000
TICK = np.arange(TICKS, dtype=np.float64)
GROUND = np.sin(0.01 * TICK) + 0.5 * np.sin(0.047 * TICK + 1.0)
THERE = np.ones(TICKS, dtype=bool)


def begun_late(record: Record, ticks: float, gained: float = 0.0) -> Record:
    """The record of a logger whose rows stand so many ticks behind those of the test, and ever further."""
    places = np.arange(record.ticks) * (1.0 + gained) + ticks
    signals = {
        name: np.interp(places, np.arange(record.ticks), values) if values.ndim == 1 else values
        for name, values in record.signals.items()
    }
    return replace(record, signals=signals)


@given(late=st.floats(0.2, 0.9).map(lambda x: x if x > 0.5 else -x - 0.3), fast=st.floats(-1e-5, 1e-5))
def test_the_start_and_the_rate_of_a_clock_are_found(late: float, fast: float) -> None:
    read = np.interp(TICK - late - fast * TICK, TICK, GROUND)
    found = start.least(read, GROUND, THERE)
    assert found == pytest.approx((late, fast), abs=1e-3)


@pytest.mark.parametrize(
    "read",
    [GROUND, 1.1 * GROUND, np.roll(GROUND, 3), GROUND + np.random.default_rng(1).normal(0.0, 0.1, TICKS)],
    ids=["as planned", "larger", "three ticks late", "with noise"],
)
def test_another_difference_is_no_start(read: np.ndarray) -> None:
    assert start.least(read, GROUND, THERE) is None


@pytest.mark.long
def test_a_logger_that_begins_between_two_ticks_shifts_no_ground(cases: Cases) -> None:
    found = examine(put_right(begun_late(imported(cases.record()), 0.3, 2e-5)))
    assert found.record.start is not None
    assert found.record.start.late == pytest.approx(-0.3 * found.record.plan.test.interval, rel=0.02)
    assert {verdict.outcome for verdict in found.verdicts} <= {"none", "tolerances"}
    assert [text for text in found.warnings if "the time at which the data logger began" in text]


@pytest.mark.long
def test_a_ground_motion_that_is_late_by_more_than_an_interval_is_named(cases: Cases) -> None:
    shifted = {"ground.time_shift": {"shift": 0.01}}
    found = examine(put_right(imported(cases.record(shifted))))
    assert found.record.start is None
    assert [name for verdict in found.verdicts for name in verdict.effects] == ["ground.time_shift"]
