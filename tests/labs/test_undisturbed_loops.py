"""The undisturbed loops of master and slave equal the compiled rollout and are recorded completely."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan.plan import Plan
from common.plan.read import from_tables, with_test
from common.recording.reader import read
from common.recording.run import Run
from common.signals import TOPICS
from loop import substructure
from loop.closed_loop import simulate
from loop.signals import rows, signals
from rths.examine.replay import planned, replay_master, replay_slaves
from tests.helpers import with_table
from tests.labs.played import run


@pytest.fixture(scope="module")
def recording(virtual_recording: Path) -> Run:
    return read(virtual_recording)


def test_the_loops_equal_the_compiled_rollout(short_plan: Plan, recording: Run) -> None:
    ground = substructure.ground_rows(short_plan, substructure.motion(short_plan))
    expected: dict[str, list[Any]] = {"master": [], "slave": []}
    for topic, values in rows(short_plan, simulate(short_plan, ground, seed=short_plan.test.seed)):
        expected[topic].append(values)
    for topic, table in expected.items():
        for place, signal in enumerate(TOPICS[topic]):
            column = np.array([values[place] for values in table])
            assert np.array_equal(recording.columns[topic][signal.name], column), f"{topic}/{signal.name}"


@pytest.mark.parametrize("kind", ["taylor", "pid_taylor", "ats"])
def test_the_loops_equal_the_rollout_with_every_correction(
    kind: str, short_plan: Plan, tmp_path: Path
) -> None:
    own: dict[str, float] = {
        "taylor": {"lead": 0.044, "order": 3},
        "pid_taylor": {"lead": 0.044, "proportional": 1.9, "integral": 0.05, "derivative": 0.0},
        "ats": {"lead": 0.03},
    }[kind]
    compensator = {"kind": kind, "force": {"cutoff": 0.05, "unity": 2.0}, **own}
    tables = with_test(short_plan, duration=2.0).tables() | {"compensator": compensator}
    tables["table"] |= {"compensator": {"kind": "taylor", "lead": 0.0189, "order": 2}}
    plan = from_tables(tables, short_plan.base)
    found, error, _ = run(plan, tmp_path / "corrected.mcap")
    assert error is None
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    expected = signals(plan, simulate(plan, ground, seed=plan.test.seed))
    for name in ("actuator_command", "displacement", "table_command", "table_displacement", "damper_force"):
        assert np.array_equal(np.asarray(found.signal(name)), expected[name]), name
    assert not np.array_equal(expected["table_command"], expected["table_target"])
    assert found.metadata["plan"]["digest"] == plan.digest()
    assert replay_matches(tmp_path / "corrected.mcap")


def replay_matches(path: Path) -> bool:
    """Asserts that the recorded computations of master and table are reproduced."""
    recording = read(path)
    matches = replay_master(recording, planned(recording)) | replay_slaves(recording, planned(recording))
    assert {"slave/table_command", "master/actuator_command"} <= matches.keys()
    return all(match.differing == 0 and match.compared > 0 for match in matches.values())


def test_the_table_follows_the_floor_behind_its_compensator(short_plan: Plan, tmp_path: Path) -> None:
    delays = []
    for number, compensator in enumerate(({}, {"kind": "taylor", "lead": 0.01885, "order": 2})):
        plan = with_table(short_plan, "table", compensator=compensator)
        found, _, _ = run(plan, tmp_path / f"{number}.mcap")
        wanted = np.concatenate([[0.0], found.columns["slave"]["table_target"][:-1]])
        got = found.columns["slave"]["table_displacement"]
        lags = np.arange(-5, 20)
        errors = [np.std((got - np.roll(wanted, lag))[50:-50]) for lag in lags]
        delays.append(2 * int(lags[int(np.argmin(errors))]))
    assert delays == [pytest.approx(18.85, abs=2.0), 0]


def test_the_same_inputs_give_the_same_bits(short_plan: Plan, recording: Run, tmp_path: Path) -> None:
    again, error, _ = run(short_plan, tmp_path / "again.mcap")
    assert error is None
    for topic, columns in recording.columns.items():
        for name, values in columns.items():
            assert values.tobytes() == again.columns[topic][name].tobytes(), f"{topic}/{name}"


def test_another_seed_gives_other_noise(short_plan: Plan, recording: Run, tmp_path: Path) -> None:
    other, _, _ = run(with_test(short_plan, seed=2), tmp_path / "other.mcap")
    assert not np.array_equal(
        other.columns["master"]["column_force"], recording.columns["master"]["column_force"]
    )


def test_every_tick_is_recorded_by_both_laboratories_and_counted_in_the_summary(
    short_plan: Plan, recording: Run
) -> None:
    for topic in ("master", "slave", "latency"):
        assert recording.sequences[topic].tolist() == list(range(short_plan.ticks))
    summary = recording.metadata["summary"]
    assert summary["ticks_expected"] == summary["master_recorded"] == summary["slave_recorded"] == "2000"
    assert summary["items_lost"] == summary["items_dropped"] == summary["deadline_misses"] == "0"
    assert summary["cause"] == "completed"
    assert recording.columns["master"]["damper_force_seq"].tolist() == list(range(-1, short_plan.ticks - 1))


def test_both_ends_of_the_link_are_recorded(recording: Run) -> None:
    for name in ("table_target", "damper_command"):
        assert np.array_equal(recording.columns["master"][name], recording.columns["slave"][name])


def test_a_test_of_three_storeys_is_recorded_storey_by_storey(short_plan: Plan, tmp_path: Path) -> None:
    plan = with_table(short_plan, "structure", mass=[1.6e5] * 3, stiffness=[9e7] * 3, damping=[4e5] * 3)
    plan = with_table(with_table(plan, "column", stiffness=45e6), "damper", floor=3)
    found, error, _ = run(plan, tmp_path / "three.mcap")
    assert error is None
    assert found.columns["master"]["displacement"].shape == (plan.ticks, 3)
