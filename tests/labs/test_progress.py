"""The progress that a user sees while a test runs shows the master's measurements."""

from __future__ import annotations

from pathlib import Path

import pytest

from common.plan import read as plans
from common.plan.plan import Plan
from common.reality import reality
from common.recording.reader import read
from simulation import virtual
from tests.helpers import ROOT


@pytest.mark.parametrize("name", ["default", "two_dampers"])
def test_progress_shows_the_newest_drift_forces_and_late_ticks(name: str, tmp_path: Path) -> None:
    test: Plan = plans.with_test(plans.load(ROOT / f"rths/plans/{name}.toml"), duration=0.5)
    bench = virtual.assemble(test, reality.as_planned(test), tmp_path / "a.mcap")
    assert virtual.run(bench, lambda: "") is None
    progress, master = bench.master.progress, read(tmp_path / "a.mcap").columns["master"]
    used = master["damper_force_used"][-1].ravel().tolist()
    assert progress["damper_force"] == (used[0] if len(used) == 1 else max(map(abs, used))) != 0.0
    assert progress["column_force"] == master["column_force"][-1]
    assert progress["drift"] == master["column_target"][-1] / test.column.deformation_ratio
    assert progress["missed"] == 0.0
