"""Measurements of others as they come: slips of time and sign, missing rows, static rows, a test without a slave."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.recording.reader import read
from common.roles import MASTER
from diagnosis.recorded import record
from diagnosis.recorded.joined import differing
from diagnosis.recorded.slips import given
from models.registry import Array

PLAN = '[test]\ninterval = {interval}\n[slave]\nkind = "none"\n'
LOOP = 'column_displacement = { column = "y", unit = "mm" }\ncolumn_force = { column = "f", scale = 1e3 }\n'
DRIVE = (
    'actuator_command = { column = "u", unit = "mm" }\ncolumn_displacement = { column = "y", unit = "mm" }\n'
)
STEP = 0.01  # s


def loops(stiff: float = 12.5, yields: float = 1.0, size: float = 6.0) -> tuple[Array, Array]:
    """An elastic-perfectly plastic specimen in cycles: mm and kN."""
    y = size * np.sin(np.linspace(0.0, 8.0 * np.pi, 400)) * np.linspace(0.3, 1.0, 400)
    force, slid = np.zeros(y.size), 0.0
    for place, now in enumerate(y):
        slid = min(max(slid, now - yields), now + yields)
        force[place] = stiff * (now - slid)
    return y, force


@pytest.fixture
def bring(call: Any, tmp_path: Path) -> Any:
    """Import columns under a map into a file of this name; the exit code."""

    def brought(
        columns: dict[str, Array], top: str, rows: str, *more: str, name: str = "a", interval: float = STEP
    ) -> int:
        data, plan, mapping = (tmp_path / f"{name}.{kind}" for kind in ("csv", "toml", "map.toml"))
        values = zip(*columns.values(), strict=True)
        data.write_text(
            "\n".join([",".join(columns), *(",".join(f"{v:.6f}" for v in row) for row in values)]) + "\n"
        )
        plan.write_text(PLAN.format(interval=interval))
        mapping.write_text(f'plan = "{name}.toml"\n{top}\n[signals]\n{rows}')
        out = tmp_path / f"{name}.mcap"
        return int(call("import", data, "--map", mapping, "-o", out, "--force", *more))

    return brought


def drive(rows: int = 400) -> dict[str, Array]:
    """A drive that follows its command with a lag: time in s, command and position in mm."""
    t = STEP * np.arange(rows)
    return {"t": t, "u": 5.0 * np.sin(5.0 * t), "y": 5.0 * np.sin(5.0 * (t - 0.04))}


def test_a_time_in_milliseconds_is_refused_until_the_map_says_so(
    bring: Any, capsys: Any, tmp_path: Path
) -> None:
    columns = drive() | {"t": 1e3 * drive()["t"]}
    assert bring(columns, 'time = "t"', DRIVE) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "its rows are 10 s apart, and the plan's interval is 0.01 s: check the unit of the time" in error
    assert bring(columns, 'time = "t"\ntime_unit = "ms"\nstart = 1.0', DRIVE) == 0
    run = read(tmp_path / "a.mcap")
    assert run.columns["master"]["t"].size == 300
    assert bring(columns, 'time = "t"\ntime_unit = "mm"', DRIVE) == 2
    assert "'time' is in mm" in capsys.readouterr().err


def test_a_row_of_units_holds_for_the_time_too(call: Any, capsys: Any, tmp_path: Path) -> None:
    rows = zip(*drive().values(), strict=True)
    text = "t,u,y\nms,mm,mm\n" + "\n".join(f"{1e3 * t:.3f},{u:.6f},{y:.6f}" for t, u, y in rows)
    (tmp_path / "a.csv").write_text(text + "\n")
    (tmp_path / "plan.toml").write_text(PLAN.format(interval=STEP))
    (tmp_path / "map.toml").write_text(f'plan = "plan.toml"\ntime = "t"\n[signals]\n{DRIVE}')
    out = tmp_path / "a.mcap"
    assert call("import", tmp_path / "a.csv", "--map", tmp_path / "map.toml", "-o", out) == 0
    assert read(out).columns["master"]["t"].size == 400
    assert (
        "units, from the row below the names or from brackets in them: time in ms" in capsys.readouterr().out
    )
    (tmp_path / "a.csv").write_text(
        text.replace("ms,mm,mm", "ticks,mm,mm") + "\n"
    )  # no unit of time, so seconds
    assert call("import", tmp_path / "a.csv", "--map", tmp_path / "map.toml", "-o", out, "--force") == 2
    assert "its rows are 10 s apart" in capsys.readouterr().err


def test_a_rate_far_from_the_plans_interval_is_imported_as_it_is(bring: Any, tmp_path: Path) -> None:
    columns = {name: values for name, values in drive(20).items() if name != "t"}
    assert bring(columns, "rate = 0.1", DRIVE) == 2
    assert bring(columns, "rate = 0.1", DRIVE, "--as-is") == 0
    assert read(tmp_path / "a.mcap").columns["master"]["t"].size == 19001


def test_rows_that_are_missing_are_said(bring: Any, capsys: Any) -> None:
    kept = np.r_[0:100, 140:250, 260:400]
    columns = {name: values[kept] for name, values in drive().items()}
    assert bring(columns, 'time = "t"', DRIVE) == 0
    assert (
        "no rows from 0.99 to 1.4 s, and in 1 shorter gaps: straight lines stand there"
        in capsys.readouterr().out
    )
    assert bring(columns, 'time = "t"', DRIVE, "--json") == 0
    assert json.loads(capsys.readouterr().out)["gaps"] == [
        pytest.approx([0.99, 1.4]),
        pytest.approx([2.49, 2.6]),
    ]


def test_the_reversed_force_of_a_yielding_specimen_is_refused(bring: Any, capsys: Any) -> None:
    y, force = loops()
    assert bring({"y": y, "f": force}, "static = true", LOOP) == 0
    assert bring({"y": y, "f": -force}, "static = true", LOOP) == 2
    error = capsys.readouterr().err
    assert "'column_force' gives work to what moves the specimen along column_displacement" in error
    assert error.count("\n") == 1
    assert bring({"y": y, "f": -force}, "static = true", LOOP, "--as-is") == 0


def test_only_a_specimen_that_gives_much_work_has_the_wrong_sign() -> None:
    y, force = loops()
    t = np.linspace(0.0, 20.0, 2000)
    motion = np.sin(t)
    assert given(y, force) == 0.0
    assert given(y, -force) > 0.3
    assert given(motion, -np.cos(t)) > 0.5  # a dashpot with the wrong sign
    assert given(motion, np.cos(t)) == 0.0
    assert given(motion, np.sin(t - 0.8)) == 0.0  # a spring whose force is late by 46°
    assert given(motion, 0.0 * t) == 0.0


def test_rows_of_static_data_mean_the_same_whatever_the_plans_interval(bring: Any, tmp_path: Path) -> None:
    y, force = loops()
    found = []
    for name, interval in (("a", 0.002), ("b", 0.05)):
        assert bring({"y": y, "f": force}, "static = true", LOOP, name=name, interval=interval) == 0
        found.append(record.build(read(tmp_path / f"{name}.mcap"), role=MASTER))
    assert found[0].plan.test.interval == found[1].plan.test.interval == record.ROW
    assert bring({"y": y, "f": force}, "rate = 100.0", LOOP, name="c") == 0
    timed = record.build(read(tmp_path / "c.mcap"), role=MASTER)
    assert timed.plan.test.interval == STEP
    assert not differing(timed, found[0])
    assert bring({"y": y, "f": force}, "rate = 100.0", LOOP, name="d", interval=0.02) == 0
    assert differing(timed, record.build(read(tmp_path / "d.mcap"), role=MASTER)) == ["test.interval"]


def test_parts_are_identified_in_a_test_without_a_slave(
    bring: Any, call: Any, capsys: Any, tmp_path: Path
) -> None:
    assert bring(drive(), 'time = "t"', DRIVE) == 0
    capsys.readouterr()
    assert call("identify", tmp_path / "a.mcap", "--json") == 0
    (part,) = json.loads(capsys.readouterr().out)["parts"]
    assert part["part"] == "actuator"
    assert part["nrmse"] < 0.01


def test_a_parameter_that_the_motion_does_not_determine_has_no_interval(
    bring: Any, call: Any, capsys: Any, tmp_path: Path
) -> None:
    columns = drive()
    columns["y"] = np.r_[0.0, columns["u"][:-1]]  # reached within the interval: neither lag nor dead time
    assert bring(columns, 'time = "t"', DRIVE) == 0
    capsys.readouterr()
    assert call("identify", tmp_path / "a.mcap", "--json") == 0
    out = capsys.readouterr().out
    assert "Infinity" not in out
    assert json.loads(out)["parts"][0]["parameters"]["delay"]["low"] is None
    assert call("identify", tmp_path / "a.mcap") == 0
    assert "not determined" in capsys.readouterr().out


def test_a_curve_of_too_few_rows_has_no_figures(bring: Any, call: Any, capsys: Any, tmp_path: Path) -> None:
    y, force = loops()
    assert bring({"y": y[:30], "f": force[:30]}, "static = true", LOOP) == 0
    capsys.readouterr()
    assert call("diagnose", tmp_path / "a.mcap") == 0
    found = capsys.readouterr()
    assert "NOT ENOUGH DATA" in found.out
    assert found.out.count("not determined") == 4
    assert "%" not in found.out
    assert "Warning" not in found.err
