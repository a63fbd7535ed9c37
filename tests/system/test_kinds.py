"""Tests of every shape over real processes: without a slave, without the master's rig, with columns at both."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from common.recording.reader import read
from common.recording.run import Run
from tests.shapes import SHIPPED, plan_of
from tests.system.started import finish, start, wait_for_ticks

pytestmark = pytest.mark.slow


def unloaded(recording: Run, role: str) -> bool:
    """Whether a column's force at the end of its ramp to rest is a small part of the largest."""
    left, largest = (
        recording.ramps[role]["column_force"][-1],
        abs(recording.columns[role]["column_force"]).max(),
    )
    return bool(abs(left) < 0.1 * largest)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_real_test_of_every_shape_is_complete(name: str, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    code, out, err = finish(start("run", SHIPPED[name], "--duration", "1", "-o", path))
    assert code == 0, out + err
    plan, recording = plan_of(name, test={"duration": 1.0}), read(path)
    assert recording.finished
    assert recording.metadata["summary"]["cause"] == "completed"
    assert recording.roles == plan.roles
    assert set(recording.ramps) == set(plan.kinds)
    for topic in recording.columns:
        assert recording.sequences[topic].tolist() == list(range(plan.ticks)), topic


def test_ctrl_c_unloads_the_column_of_a_slave(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    process = start("run", "two_columns", "--scale", "0.5", "-o", path)
    wait_for_ticks(path, 1000)
    process.send_signal(signal.SIGINT)
    code, out, err = finish(process)
    assert code == 3, out + err
    recording = read(path)
    assert unloaded(recording, "master")
    assert unloaded(recording, "slave.east")
