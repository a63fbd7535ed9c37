"""Records of a test on its ticks: gaps, missing channels, plans, the ideal test."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from common.errors import InputError
from common.recording.reader import read
from common.recording.run import GROUND, Run
from common.roles import MASTER
from diagnosis.diagnose import not_recorded
from diagnosis.recorded import record
from diagnosis.recorded.divided import parts_of
from diagnosis.recorded.ground import Ground
from tests.diagnosis.cases import Cases, short


def run_of(cases: Cases) -> Run:
    """A recording of ten seconds that a test may change."""
    return read(cases.file())


def without(run: Run, topic: str, *names: str) -> Run:
    """The recording with channels taken away."""
    for name in names:
        del run.columns[topic][name]
    return run


def kept(run: Run, topic: str, rows: NDArray[np.int64]) -> Run:
    """The recording with some messages of a topic only."""
    run.columns[topic] = {name: values[rows] for name, values in run.columns[topic].items()}
    run.sequences[topic] = run.sequences[topic][rows]
    return run


def test_a_shifted_ground_motion_is_known_up_to_the_end_of_the_test(cases: Cases) -> None:
    shift = -0.02
    whole = cases.record({"ground.time_shift": {"shift": shift}}, duration=4.0)
    assert whole.ground is not None
    system = whole.systems[MASTER]
    later = replace(system, effects=replace(system.effects, time_shift=shift))
    part = Ground(whole, whole.ground)
    np.testing.assert_allclose(part.predict(later), part.measured, atol=1e-12)


@given(
    st.lists(st.one_of(st.none(), st.just(np.nan), st.floats(-1e6, 1e6)), max_size=40),
    st.integers(0, 5),
)
def test_values_are_held_over_gaps_and_gaps_are_marked(rest: list[float | None], more: int) -> None:
    given_ = [*rest, 1.0]  # a channel holds a message at least
    places = np.array([i for i, value in enumerate(given_) if value is not None], dtype=np.int64)
    values = np.array([value for value in given_ if value is not None], dtype=np.float64)
    ticks = len(given_) + more
    held, there = record.laid_out(values, places, ticks)
    finite = {int(p): float(v) for p, v in zip(places, values, strict=True) if np.isfinite(v)}
    last = finite[min(finite)] if finite else 0.0  # before the first value there is the first
    for tick in range(ticks):
        last = finite.get(tick, last)
        assert held[tick] == last
        assert there[tick] == (tick in finite)


def test_one_storey_that_is_not_finite_makes_a_tick_missing() -> None:
    values = np.array([[1.0, 2.0], [np.inf, 3.0], [5.0, 6.0]])
    held, there = record.laid_out(values, np.array([0, 1, 3]), 5)
    assert there.tolist() == [True, False, False, True, False]
    assert held.tolist() == [[1, 2], [1, 2], [1, 2], [5, 6], [5, 6]]


def test_a_complete_recording_has_every_signal(cases: Cases) -> None:
    found = record.build(run_of(cases))
    assert found.ticks == 5000
    assert found.has("displacement", "column_force", "table_command", "damper_force", "damper_force_used")
    assert not found.has("column_forse")
    assert all(mask.all() for mask in found.present.values())
    assert found.time[-1] == pytest.approx(9.998)
    assert found.ground is not None
    assert found.ground.shape == (2, 5001)
    assert np.array_equal(found.ground[0, :-1], found.signals["ground_acceleration"])


def test_missing_messages_are_marked_and_held(cases: Cases) -> None:
    whole = run_of(cases)
    rows = np.flatnonzero((np.arange(5000) < 1000) | (np.arange(5000) >= 1100))
    found = record.build(kept(run_of(cases), "master", rows))
    assert found.ticks == 5000
    mask = found.present["column_force"]
    assert not mask[1000:1100].any()
    assert mask.sum() == 4900
    force = whole.columns["master"]["column_force"]
    assert set(found.signals["column_force"][1000:1100]) == {force[999]}
    assert np.array_equal(found.signals["column_force"][mask], force[mask])
    assert found.present["damper_force"].all()
    assert found.has("column_force")


def test_a_signal_that_is_mostly_missing_counts_as_not_recorded(cases: Cases) -> None:
    run = run_of(cases)
    run.columns["slave"]["damper_stroke"][::2] = np.nan
    run.columns["slave"]["damper_stroke"][:10] = np.nan
    assert not record.build(run).has("damper_stroke")


def test_signals_that_were_not_recorded_are_reported_and_the_others_judged(cases: Cases) -> None:
    run = without(run_of(cases), "slave", "table_displacement", "table_acceleration")
    run = without(run, "master", "actuator_command")
    found = record.build(run)
    warnings = not_recorded(found)
    names = [part.name for part in parts_of(found)]
    assert names == ["ground", "structure", "column", "laboratory B"]
    assert any("table_displacement, table_acceleration" in text for text in warnings)
    assert any("actuator_command" in text for text in warnings)


def test_a_building_that_cannot_be_judged_is_reported(cases: Cases) -> None:
    whole = run_of(cases)
    judged = record.build(whole)
    found = record.build(without(whole, "master", "damper_force_used"))
    sentence = "The building cannot be judged without damper_force_used."
    assert "structure" not in [part.name for part in parts_of(found)]
    assert sentence in not_recorded(found)
    assert sentence not in not_recorded(judged)


def test_a_recording_of_one_laboratory_is_judged_alone(cases: Cases) -> None:
    run = run_of(cases)
    del run.columns["master"], run.sequences["master"]
    found = record.build(run)
    assert [part.name for part in parts_of(found)] == ["laboratory B"]
    assert not found.has("column_force")


def test_a_recording_without_a_plan_is_refused_in_one_sentence(cases: Cases) -> None:
    run = run_of(cases)
    del run.metadata["plan"]
    with pytest.raises(InputError, match=r"carries no plan: give .* --plan\.$"):
        record.build(run)
    given_ = record.build(run, short())
    assert given_.plan.test.interval == 0.002
    assert given_.ground is not None


def test_a_recording_without_signals_is_refused(cases: Cases) -> None:
    run = run_of(cases)
    for topic in ("master", "slave"):
        del run.columns[topic], run.sequences[topic]
    with pytest.raises(InputError, match="no signals of a master or a slave"):
        record.build(run)


def test_another_plan_gives_another_nominal_ground_motion(cases: Cases) -> None:
    found = record.build(run_of(cases), short(scale=0.2))
    assert found.ground is not None
    assert np.allclose(found.ground[0, :-1], 2.0 * found.signals["ground_acceleration"])


def test_a_recording_longer_than_its_ground_motion_holds_the_last_value(cases: Cases) -> None:
    run = run_of(cases)
    rows = np.frombuffer(run.attachments[GROUND], dtype="<f8").reshape(2, -1)[:, :3000]
    run.attachments[GROUND] = rows.tobytes()
    found = record.build(run).ground
    assert found is not None
    assert found.shape == (2, 5001)
    assert set(found[0, 3000:]) == {found[0, 2999]}


@pytest.mark.long
def test_in_the_ideal_test_the_transfer_systems_are_commanded_with_their_targets(cases: Cases) -> None:
    plain, held = record.build(run_of(cases)), record.build(run_of(cases), against_ideal=True)
    target = plain.signals["column_target"]
    assert np.array_equal(held.signals["actuator_command"][:-1], target[1:])
    assert np.array_equal(held.signals["table_command"], plain.signals["table_target"])
    assert held.plan.actuator.delay == held.plan.actuator.time_constant == 0.0
    assert held.plan.table.frequency == np.inf
    assert plain.plan.actuator.delay == 0.014
