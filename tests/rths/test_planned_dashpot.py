"""A specimen with a dashpot in its plan, driven by a motion that was read with noise."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rths.examine.diagnose import diagnose_file

STEP, ROWS = 1.0 / 1024.0, 12 * 1024
NOISE = 3e-6  # m
STIFFNESS, DASHPOT = 2e6, 1.5e5


@pytest.mark.long
def test_noise_of_a_motion_that_a_planned_dashpot_multiplies_is_no_gap(call: Any, tmp_path: Path) -> None:
    rng, t = np.random.default_rng(3), STEP * np.arange(ROWS)
    waves = sum(0.01 / f * np.sin(2.0 * np.pi * f * t + f) for f in (0.5, 1.3, 4.1, 9.0))
    x = waves * np.sin(np.pi * t / t[-1]) ** 2
    force = 0.99 * STIFFNESS * x + 1.01 * DASHPOT * np.gradient(x, STEP) + 60.0 * rng.standard_normal(ROWS)
    rows = np.column_stack([1e3 * (x + NOISE * rng.standard_normal(ROWS)), 1e-3 * force])
    np.savetxt(tmp_path / "a.csv", rows, "%.5f", ",", header="x,f", comments="")
    (tmp_path / "plan.toml").write_text(
        f'[test]\ninterval = {STEP}\n[slave]\nkind = "none"\n[column]\nmodel = "linear"\n'
        f"stiffness = {STIFFNESS}\ndamping = {DASHPOT}\n"
    )
    (tmp_path / "map.toml").write_text(
        'plan = "plan.toml"\nrate = 1024.0\n[signals]\ncolumn_displacement = { column = "x", unit = "mm" }\n'
        'column_force = { column = "f", unit = "kN" }\n'
    )
    path = tmp_path / "a.mcap"
    assert call("import", tmp_path / "a.csv", "--map", tmp_path / "map.toml", "-o", path) == 0
    report = diagnose_file(path)
    assert report.status == "within_tolerances"
    assert report.gap.overall == pytest.approx(0.01, abs=0.005)
