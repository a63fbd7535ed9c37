"""A rig that takes longer to arm than a running test may be silent: the recorder waits as the laboratories do."""

from __future__ import annotations

from pathlib import Path

import pytest

from common.recording.reader import read
from common.roles import MASTER
from recorder.loop import SILENCE_NS
from tests.faults.simulated import Scene

ARMING = 3 * SILENCE_NS
TICKS = 50


def test_a_rig_may_take_longer_to_arm_than_the_recorder_waits_during_a_test(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = Scene(tmp_path, TICKS * 0.002)
    probe = scene.simulation.probes[MASTER]
    arm = probe.inner.arm

    def slowly() -> None:
        probe.process.spend(ARMING)
        arm()

    monkeypatch.setattr(probe.inner, "arm", slowly)
    scene.simulation.run()
    run = read(scene.path)
    assert run.metadata["summary"]["outcome"] == "stop"
    assert run.metadata["summary"]["cause"] == "completed"
    assert run.metadata["summary"]["slave_recorded"] == str(TICKS)
