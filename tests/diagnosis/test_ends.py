"""Ends of readings that a resampling filter spoilt, and readings that stand before their time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from diagnosis.diagnose import examine, put_right
from diagnosis.signals import edges
from models.registry import Array
from tests.diagnosis.cases import Cases, imported

INTERVAL = 0.002
EARLY = 1.75e-3  # s, of a reading that stands in the row of the command that follows it
TIME: Array = INTERVAL * np.arange(6000, dtype=np.float64)


def resampled(values: Array) -> Array:
    """A reading at twice its rate and back, by a filter that takes zeros for what lies beyond the ends."""
    return np.asarray(signal.resample_poly(signal.resample(values, 2 * values.size), 1, 2))


def early(values: Array) -> Array:
    """A reading that stands before its time."""
    places = np.arange(values.size) + EARLY / INTERVAL
    return np.asarray(np.interp(places, np.arange(values.size), values))


def test_an_end_that_bends_is_spoilt_and_a_motion_is_not() -> None:
    noise = np.random.default_rng(1).normal(0.0, 1e-6, TIME.size)
    slow = noise + 1e-4 * np.sin(2.0 * np.pi * 3.0 * TIME)
    assert not edges.spoilt(slow).any()
    held = slow.copy()
    held[-6:] += 2e-4
    bad = edges.spoilt(held)
    assert bad[-3:].all()
    assert not bad[: -edges.TICKS - 5].any()
    assert edges.spoilt(held[::-1])[:3].all()
    assert not edges.spoilt(np.random.default_rng(2).standard_t(3, TIME.size)).all()


@pytest.mark.long
def test_ends_of_a_resampled_reading_are_left_out(cases: Cases) -> None:
    found = examine(put_right(imported(cases.record(), resampled)))
    assert "damper_stroke" in found.record.edges
    assert {verdict.outcome for verdict in found.verdicts} <= {"none", "tolerances"}
    assert [text for text in found.warnings if "bend as at the ends of a filter" in text]


@pytest.mark.long
def test_readings_of_all_laboratories_before_their_time_are_put_right(cases: Cases) -> None:
    found = examine(put_right(imported(cases.record(), early)))
    assert found.record.early == pytest.approx(EARLY, rel=0.2)
    assert {verdict.outcome for verdict in found.verdicts} <= {"none", "tolerances"}
    assert [text for text in found.warnings if "before their time" in text]


@pytest.mark.long
@pytest.mark.parametrize(
    "effects",
    [{}, {"actuator.delay": {"delay": -4e-3}}, {"table.delay": {"delay": -2e-3}}],
    ids=["clean", "quick actuator", "quick table"],
)
def test_one_quick_machine_is_no_early_logger(cases: Cases, effects: dict[str, dict[str, float]]) -> None:
    assert put_right(imported(cases.record(effects))).early == 0.0
