"""A drive by itself as a logger sees it: its command held, rows far apart, and rows that are missing."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from common.recording.imported import imported
from common.recording.reader import read
from diagnosis.recorded import record
from diagnosis.recorded.divided import parts_of
from diagnosis.recorded.parts import LaboratoryPart
from models.registry import Array

PLAN = """[test]
interval = {interval}
[slave]
kind = "none"
[actuator]
gain = 1.0
delay = 0.0
time_constant = 0.03
[compensator]
kind = "none"
[sensors]
column_displacement = 5e-6
"""
MAP = """plan = "drive.toml"
time = "t"
[signals]
actuator_command = {{ column = "u", unit = "mm" }}
column_displacement = {{ column = "y", unit = "mm"{more} }}
"""
LAG = 0.03  # s, as planned
FILTER = ', filter = { type = "bessel", order = 4, cutoff = 400.0 }'
KEPT = 10  # of so many rows of the fast log one is in the slow one


def held(seconds: float, step: float = 1e-3) -> tuple[Array, Array, Array]:
    """A lag that is driven by a held command, with noise of 5 µm: time in s, command and position in mm."""
    t = step * np.arange(round(seconds / step), dtype=np.float64)
    u = 4.0 * np.sin(2.0 * np.pi * 0.7 * t) + 2.0 * np.sin(2.0 * np.pi * 1.9 * t)
    y, share = np.zeros(t.size), 1.0 - math.exp(-step / LAG)
    for k in range(t.size - 1):
        y[k + 1] = y[k] + share * (u[k] - y[k])
    return t, u, y + 5e-3 * np.random.default_rng(5).standard_normal(t.size)


@pytest.fixture
def bring(call: Any, tmp_path: Path) -> Any:
    """Import rows of the drive at an interval (s) of the plan; the recording's path."""

    def brought(interval: float, rows: Any, more: str = "", command: str = "ramp") -> Path:
        plan = PLAN.format(interval=interval).replace(
            "[compensator]", f'command = "{command}"\n[compensator]'
        )
        (tmp_path / "drive.toml").write_text(plan)
        (tmp_path / "map.toml").write_text(MAP.format(more=more))
        table = np.column_stack(held(12.0))[rows]
        np.savetxt(tmp_path / "a.csv", table, "%.6f", ",", header="t,u,y", comments="")
        path = tmp_path / "a.mcap"
        assert call("import", tmp_path / "a.csv", "--map", tmp_path / "map.toml", "-o", path) == 0
        return path

    return brought


def diagnosed(call: Any, path: Path, capsys: Any) -> str:
    capsys.readouterr()
    assert call("diagnose", path) == 0
    return str(capsys.readouterr().out)


@pytest.mark.parametrize(
    ("interval", "rows", "more"),
    [
        (1e-3, slice(None), ""),
        (1e-3, slice(None), FILTER),  # which is not there
        (1e-2, slice(None, None, KEPT), ""),
    ],
)
def test_a_drive_as_planned_may_hold_its_command_or_not(
    bring: Any, call: Any, capsys: Any, interval: float, rows: slice, more: str
) -> None:
    said = diagnosed(call, bring(interval, rows, more), capsys)
    assert said.startswith(("NO GAP", "WITHIN TOLERANCES"))
    assert "far beyond its noise" not in said


def test_what_a_drive_did_while_rows_are_missing_is_left_out(bring: Any, call: Any, capsys: Any) -> None:
    t = held(12.0)[0]
    path = bring(1e-3, (t < 5.0) | (t > 5.4))
    run = read(path)
    stated = imported(run)
    assert stated is not None
    (gap,) = stated.gaps
    assert gap == pytest.approx((4.999, 5.401))
    (part,) = (one for one in parts_of(record.build(run, role="master")) if isinstance(one, LaboratoryPart))
    missing = ~part.present[:, part.signals.index("column_displacement")]
    first, last = np.flatnonzero(missing)[[0, -1]]
    assert first == 5000
    assert 3.0 * LAG < 1e-3 * last - 5.4 < 15.0 * LAG  # a lag remembers e⁻⁷ after seven of its time constants
    assert missing[first : last + 1].all()
    assert diagnosed(call, path, capsys).startswith(("NO GAP", "WITHIN TOLERANCES"))


@pytest.mark.parametrize(("command", "steps"), [("ramp", 1), ("held", 0)])
def test_a_drive_that_holds_its_command_by_its_plan_is_replayed_so(
    bring: Any, command: str, steps: int
) -> None:
    whole = record.build(read(bring(1e-3, slice(None), command=command)), role="master")
    (part,) = (one for one in parts_of(whole) if isinstance(one, LaboratoryPart))
    assert part.steps == steps
    place = part.signals.index("column_displacement")
    missed = part.measured[:, place] - part.predict(whole.systems["master"])[:, place]
    assert bool(np.std(missed) < 1.05 * 5e-6) is (command == "held")


def test_a_motors_command_is_held_from_its_row_on_where_an_interval_is_one_step(
    call: Any, tmp_path: Path
) -> None:
    mass, spring, dashpot, step = 95.0, 5e3, 200.0, 1e-3
    t = step * np.arange(4000)
    force = np.where(np.sin(2.0 * np.pi * 0.9 * t) > 0.3, 40.0, 0.0) + 20.0 * np.sin(2.0 * np.pi * 3.0 * t)
    moves = expm(step * np.array([[0.0, 1.0, 0.0], [-spring / mass, -dashpot / mass, 1.0 / mass], [0.0] * 3]))
    state, stroke = np.zeros(2), np.empty(t.size)
    for k, push in enumerate(force):
        stroke[k] = state[0]
        state = moves[:2] @ [*state, push]
    np.savetxt(tmp_path / "a.csv", np.column_stack([force, stroke]), "%.12g", ",", header="F,q", comments="")
    (tmp_path / "motor.toml").write_text(
        f"[test]\ninterval = {step}\n[damper]\nmass = {mass}\nstiffness = {spring}\ndamping = {dashpot}\n"
        "motor_time_constant = 0.0\n"
    )
    (tmp_path / "map.toml").write_text(
        f'plan = "motor.toml"\nrate = {1.0 / step}\n[signals]\ndamper_command = {{ column = "F" }}\n'
        'damper_stroke = { column = "q" }\ntable_acceleration = { value = 0.0 }\n'
    )
    path = tmp_path / "a.mcap"
    assert call("import", tmp_path / "a.csv", "--map", tmp_path / "map.toml", "-o", path) == 0
    built = record.build(read(path), role="slave")
    (part,) = (one for one in parts_of(built) if isinstance(one, LaboratoryPart))
    said = part.predict(built.systems["slave"])[:, part.signals.index("damper_stroke")]
    assert np.max(np.abs(said - stroke)) < 1e-9 * np.max(np.abs(stroke))
