"""`rths check` and `rths report` of a machine by itself show no building that nobody planned or recorded."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan import read as plans
from common.plan.toml_file import tables_in
from common.recording.reader import read
from report.facts.machine import by_itself, own_plan
from report.facts.summary import summarize
from report.pictures import PICTURES, needs, shows
from report.plan import machine
from report.run.page import page
from tests.helpers import ROOT
from tests.rths.imports import COMMAND, DRIVE, LATE, TIMES, table

ALONE = '[test]\nname = "drive"\n[slave]\nkind = "none"\n[actuator]\ndelay = "2 ms"\ntime_constant = 0.03\n'
TABLE = '[master]\nkind = "none"\n[slave]\nkind = "table"\n[table]\nfrequency = 20.0\n'


def checked(call: Any, capsys: Any, tmp_path: Path, text: str, *more: str) -> tuple[int, dict[str, Any], str]:
    path = tmp_path / "plan.toml"
    path.write_text(text)
    code = call("check", path, "--json", *more)
    facts = json.loads(capsys.readouterr().out)
    assert call("check", path, *more) == code
    return code, facts, capsys.readouterr().out


def test_check_shows_what_the_plan_states_of_the_machine(call: Any, capsys: Any, tmp_path: Path) -> None:
    code, facts, said = checked(call, capsys, tmp_path, ALONE)
    assert code == 0
    assert facts["machine"] == {
        "actuator": {
            "delay": {"value": 0.002, "unit": "s"},
            "time_constant": {"value": 0.03, "unit": "s"},
        }
    }
    assert (facts["structure"], facts["ground_motion"], facts["peaks"]) == (None, None, {})
    assert "actuator          delay 0.002 s, time_constant 0.03 s\n" in said
    assert "The plan is of a machine by itself" in said
    assert not {"mode 1", "El Centro", "peaks expected", "pre-flight"} & {
        word for word in ("mode 1", "El Centro", "peaks expected", "pre-flight") if word in said
    }


def test_values_of_a_law_have_its_units(call: Any, capsys: Any, tmp_path: Path) -> None:
    law = '[column]\nmodel = "bilinear"\nstiffness = 1e6\nyield_displacement = "3 mm"\nhardening = 0.1\n'
    code, _, said = checked(call, capsys, tmp_path, f'[test]\nname = "c"\n[slave]\nkind = "none"\n{law}')
    assert code == 0
    assert "model bilinear, stiffness 1e+06 N/m, yield_displacement 0.003 m, hardening 0.1\n" in said


def test_check_describes_its_test_where_that_is_asked_for(call: Any, capsys: Any, tmp_path: Path) -> None:
    code, facts, said = checked(call, capsys, tmp_path, ALONE, "--building")
    assert code == (0 if facts["ready"] else 1)
    assert len(facts["structure"]["modes"]) == 1
    assert "mode 1" in said


def test_check_finds_slips_of_a_machine(call: Any, capsys: Any, tmp_path: Path) -> None:
    _, facts, said = checked(
        call, capsys, tmp_path, f"{ALONE}[sensors]\ncolumn_displacement = 0.01\n[compensator]\nlead = 14.0\n"
    )
    assert [one["where"] for one in facts["slips"]] == [
        "lead in [compensator]",
        "column_displacement in [sensors]",
    ]
    assert "a slip of units? lead in [compensator]" in said


def test_values_of_a_table_within_a_table_are_shown(call: Any, capsys: Any, tmp_path: Path) -> None:
    text = ALONE.replace('delay = "2 ms"\ntime_constant = 0.03\n', 'model = "servo_hydraulic"\n')
    _, facts, _ = checked(
        call, capsys, tmp_path, f"{text}[actuator.servo]\nleakage = 4.0\n[column]\nmass = 100.0\n"
    )
    assert facts["machine"]["actuator"]["servo.leakage"]["value"] == 4.0


@pytest.mark.parametrize(
    ("text", "alone"),
    [
        (ALONE, True),
        (TABLE, True),
        (f"{ALONE}[structure]\nmass = 160e3\n", False),
        (f"{ALONE}[ground_motion]\nscale = 0.2\n", False),
        (ALONE.replace('[slave]\nkind = "none"\n', ""), False),  # with the default slave
        ('[slave]\nkind = "none"\n', False),  # of which nothing is said: the default test without its slave
        (f'{ALONE}[master.rig]\nclass = "rig.py:Rig"\n', False),
        ('[slave]\nkind = "none"\n[table]\nfrequency = 20.0\n', False),  # of a table that is not there
    ],
)
def test_a_plan_is_of_a_machine_by_itself_where_it_states_one_and_no_building(text: str, alone: bool) -> None:
    assert machine.by_itself(plans.parse(text, Path()), tables_in(text, "plan")) is alone


def test_the_plans_that_ship_are_of_whole_tests() -> None:
    for path in (ROOT / "rths" / "plans").glob("*.toml"):
        assert not machine.by_itself(plans.load(path), tables_in(path.read_text(), "plan"))


def test_a_users_kind_is_tried(call: Any, capsys: Any, tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    path.write_text('[master]\nkind = "absent.py:Kind"\n[slave]\nkind = "none"\n')
    assert call("check", path) == 2
    assert "absent.py" in capsys.readouterr().err


@pytest.fixture
def drive(bring: Any) -> Any:
    """An imported drive."""
    code, run = bring(table("t,u,y", TIMES, COMMAND, LATE), DRIVE)
    assert code == 0
    return run


def test_the_report_of_a_drive_has_no_building(drive: Any) -> None:
    assert by_itself(drive)
    text = page(drive, summarize(drive), {}, {})
    assert "<dt>storeys" not in text
    assert "[structure]" not in text
    assert "[ground_motion]" not in text
    assert "[actuator]" in text
    for picture in PICTURES.values():
        said = f"{shows(drive, picture)} {needs(drive, picture)}"
        assert picture.name == "spectra" or not {"ground", "floors"} & {*said.replace(",", "").split()}
    assert "natural" not in shows(drive, PICTURES["spectra"])


def test_a_building_that_a_plan_states_stays_in_its_text(bring: Any) -> None:
    plan = "[test]\ninterval = 0.01\nduration = 1.0\n[structure]\nmass = 2e5\n"
    _, run = bring(table("t,u,y", TIMES, COMMAND, LATE), DRIVE, plan=plan)
    assert "[structure]" in own_plan(run)
    assert "[ground_motion]" not in own_plan(run)


def test_the_report_of_a_whole_test_keeps_its_building(virtual_recording: Path) -> None:
    run = read(virtual_recording)
    assert not by_itself(run)
    assert own_plan(run) == run.metadata["plan"]["toml"]
    assert shows(run, PICTURES["histories"]) == PICTURES["histories"].text


def test_an_import_of_a_building_is_no_machine(bring: Any) -> None:
    rows = f'{DRIVE}displacement = {{ column = "u", unit = "mm" }}\n'
    code, run = bring(table("t,u,y", TIMES, COMMAND, LATE), rows, 'time = "t"\n', "--as-is")
    assert code == 0
    assert not by_itself(run)
    assert np.isfinite(run.columns["master"]["displacement"]).all()
