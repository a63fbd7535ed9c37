"""The import map: units, properties of the logger, the part of the file, its format, and mistaken units or signs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.recording.logger.low_pass import LoggerFilter
from common.recording.reader import read
from diagnosis.recorded import slips
from diagnosis.recorded.record import build
from report.facts.summary import summarize
from report.text.tabular import read_table
from report.text.text_form import StatedForm, TextForm
from tests.rths.imports import COMMAND, DRIVE, FORCE, LATE, PLAN, TIMES, known, table


def test_units_give_the_scales_and_the_loggers_properties_are_kept(bring: Any) -> None:
    rows = DRIVE + (
        'column_force = { column = "f", unit = "kN", delay = "2 ms", resolution = "0.1 kN", calibration = 0.01, '
        'high_pass = 0.5, average = "10 ms", means = 3, '
        'filter = { type = "butterworth", order = 4, cutoff = 100.0 } }\n'
    )
    code, run = bring(table("t,u,y,f", TIMES, COMMAND, LATE, FORCE), rows)
    assert code == 0
    assert np.allclose(run.columns["master"]["column_displacement"], 1e-3 * LATE, atol=1e-11)
    assert np.allclose(run.columns["master"]["column_force"], 1e3 * FORCE, atol=1e-5)
    stated = known(run).channel("master", "column_force")
    assert (stated.delay, stated.resolution, stated.calibration) == (0.002, 100.0, 0.01)
    assert stated.filter == LoggerFilter("butterworth", 4, 100.0)
    assert (stated.high_pass, stated.average, stated.means) == (0.5, 0.01, 3)
    assert stated.rate == pytest.approx(100.0)
    assert not stated.interpolated


def test_a_row_at_the_very_start_of_the_test_is_read(bring: Any) -> None:
    times = 1e3 * TIMES + 100130.0 - 1e-7  # as sums of steps of a computer come out
    code, run = bring(
        table("t,u,y", times, COMMAND, LATE),
        DRIVE,
        'time = "t"\ntime_unit = "ms"\nstart = 100.13\nstop = 102.1299999999\n',
    )
    assert code == 0
    assert run.columns["master"]["t"].size == 201
    assert run.columns["master"]["column_displacement"][0] == pytest.approx(1e-3 * LATE[0], abs=1e-9)


def test_the_decimals_of_a_text_are_kept_where_all_rows_have_as_many(bring: Any) -> None:
    rows = [f"{t:.6f},{u:.9g},{y:.2f}" for t, u, y in zip(TIMES, COMMAND, LATE, strict=True)]
    code, run = bring("t,u,y\n" + "\n".join(rows) + "\n", DRIVE)
    assert code == 0
    assert known(run).channel("master", "column_displacement").printed == pytest.approx(1e-5)
    assert known(run).channel("master", "actuator_command").printed == 0.0


def test_a_delay_of_none_is_stated_where_the_map_gives_it(bring: Any) -> None:
    rows = DRIVE.replace("column_displacement = {", "column_displacement = { delay = 0.0,")
    _, run = bring(table("t,u,y", TIMES, COMMAND, LATE), rows)
    channels = [known(run).channel("master", name) for name in ("column_displacement", "actuator_command")]
    assert [(one.delay, one.delay_stated) for one in channels] == [(0.0, True), (0.0, False)]


def test_files_with_semicolons_decimal_commas_a_preamble_and_a_row_of_units_are_read(
    bring: Any, capsys: Any
) -> None:
    text = table(
        "t;u;y", TIMES, COMMAND, LATE, between=";", decimal=",", below="s;mm;mm", above="Logger Müller"
    )
    rows = 'actuator_command = { column = "u" }\ncolumn_displacement = { column = "y" }\n'
    stated = 'time = "t"\nseparator = ";"\ndecimal = ","\nskip_rows = 1\n'
    for top in (stated, 'time = "t"\n'):  # what a map leaves out is recognised
        code, run = bring(text, rows, top)
        assert code == 0
        assert np.allclose(run.columns["master"]["column_displacement"], 1e-3 * LATE, atol=1e-11)
        said = capsys.readouterr().out
        assert "text: ';' between columns, decimal sign ',', 1 rows above the names" in said
        assert "units, from the row below the names or from brackets in them: actuator_command in mm" in said
    assert bring(text, rows, 'time = "t"\nseparator = ","\n')[0] == 2
    assert "a map can give its separator, decimal sign and rows to skip" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "form", "columns"),
    [
        ("t,u\n0,1\n1,2\n2,3\n", TextForm(), ["t", "u"]),
        ("t;u\n0,0;1,5\n0,1;2\n0,2;3,5\n", TextForm(";", ","), ["t", "u"]),
        ("t;u\n0.0;1.5\n0.1;2.5\n", TextForm(";"), ["t", "u"]),
        ("t\tu\n(s)\t(mm)\n0.0\t1.5\n0.1\t2.5\n", TextForm("\t"), ["t", "u"]),
        ("Run;7;;\nDate;1.2.2024;;\nt;u;;\ns;mm;;\n0;1,5;;\n1;2,5;;\n", TextForm(";", ",", 2), ["t", "u"]),
        ("Bench,A\nt,u\n0,1\n1,2\n", TextForm(skip_rows=1), ["t", "u"]),  # by the names that are looked for
        ("t,u\n0,\n1,2\n2,\n", TextForm(), ["t", "u"]),
        ("t u\n0.0 1.5\n0.1 2.5\n", TextForm(" "), ["t", "u"]),
        (
            "Run 7\n    t      u\n    s     mm\n  0,0   10,5\n  0,1   -2,5\n",
            TextForm(" ", ",", 1),
            ["t", "u"],
        ),
    ],
)
def test_the_form_of_a_text_file_is_recognised(
    text: str, form: TextForm, columns: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "data.txt"
    path.write_text(text)
    found = read_table(path, StatedForm(columns=("t",)))
    assert found.form == form
    assert list(found.columns)[:2] == columns


def test_start_and_stop_select_a_part_of_the_data(bring: Any) -> None:
    code, run = bring(table("t,u,y", TIMES, COMMAND, LATE), DRIVE, 'time = "t"\nstart = 1.0\nstop = 2.0\n')
    assert code == 0
    displacement = run.columns["master"]["column_displacement"]
    assert displacement.size == 101
    assert np.allclose(displacement, 1e-3 * LATE[100:201], atol=1e-9)
    assert run.columns["master"]["t"][0] == 0.0


def test_static_data_keep_their_rows_and_need_no_time(bring: Any) -> None:
    code, run = bring(table("u,y,f", COMMAND, COMMAND, FORCE), DRIVE, "static = true\n")
    assert code == 0
    assert known(run).static
    assert run.ticks("master") == 400
    assert {facts["t"] for facts in summarize(run)["peaks"].values()} == {None}
    assert not known(run).channel("master", "column_displacement").interpolated


SLIPS = {
    "millimetres for metres": (
        1e3 * LATE,
        FORCE,
        "'column_displacement' is 1,010 times what the plan predicts",
    ),
    "kilonewtons for newtons": (
        LATE,
        1e-3 * FORCE,
        "about a factor of 1000: check the units of its column",
    ),
    "a wrong sign": (
        -LATE,
        FORCE,
        "'column_displacement' has the opposite sign of what the plan predicts from actuator_command",
    ),
}


@pytest.mark.parametrize("case", SLIPS.values(), ids=SLIPS)
def test_a_mistaken_unit_or_sign_is_refused_in_one_sentence(bring: Any, capsys: Any, case: Any) -> None:
    position, force, message = case
    text = table("t,u,y,f", TIMES, COMMAND, position, force)
    rows = DRIVE + 'column_force = { column = "f", unit = "kN" }\n'
    assert bring(text, rows)[0] == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert message in error
    assert bring(text, rows, 'time = "t"\n', "--as-is")[0] == 0


def test_a_motion_against_its_prediction_is_no_wrong_sign_where_its_shape_differs() -> None:
    ticks = np.arange(4000) * 0.002
    predicted = np.sin(2.0 * np.pi * ticks)
    for phase, wrong in ((150.0, False), (160.0, True)):
        measured = np.sin(2.0 * np.pi * ticks - np.radians(phase))
        factor = slips.compared(measured, predicted, 0.0, 0)
        assert (factor is not None and factor < 0.0) == wrong


def test_a_mass_that_is_thrown_back_from_some_motion_on_has_no_wrong_sign() -> None:
    ticks = np.arange(20_000) * 0.002
    predicted = ticks * np.sin(2.0 * np.pi * ticks)
    thrown = np.where(ticks < 0.3 * ticks[-1], predicted, -predicted)
    assert slips.compared(thrown, predicted, 0.0, 50) is None
    assert slips.compared(-predicted, predicted, 0.0, 50) == pytest.approx(-1.0)


def test_a_force_without_a_command_is_checked_against_the_measured_deformation(
    bring: Any, capsys: Any
) -> None:
    rows = 'column_displacement = { column = "y" }\ncolumn_force = { column = "f", unit = "kN" }\n'
    assert bring(table("t,y,f", TIMES, LATE, FORCE), rows)[0] == 2
    assert (
        "'column_force' is 1/1,000 of what the plan predicts from column_displacement"
        in capsys.readouterr().err
    )


WRONG = {
    "unit of another quantity": (
        'x = { column = "u", unit = "kN" }',
        "",
        "'actuator_command' in [signals] is in kN",
    ),
    "means without a time": (
        'x = { column = "u", means = 3 }',
        "",
        "means of 'actuator_command' in [signals] needs `average`, the time of one such mean",
    ),
    "unit and scale": ('x = { column = "u", unit = "mm", scale = 1.0 }', "", "both a unit and a scale"),
    "unknown filter": (
        'x = { column = "u", filter = { type = "butter", order = 4, cutoff = 1.0 } }',
        "",
        "butterworth",
    ),
    "filter without cutoff": ('x = { column = "u", filter = { type = "bessel", order = 4 } }', "", "cutoff"),
    "name in place of a table": ('x = "u"', "", 'must be a table such as { column = "name" }'),
    "name in place of a filter": (
        'x = { column = "u", filter = "bessel" }',
        "",
        "must be a table such as { type =",
    ),
    "negative ripple": (
        'x = { column = "u", filter = { type = "chebyshev", order = 4, cutoff = 80.0, ripple = -1.0 } }',
        "",
        "ripple",
    ),
    "ripple of a Bessel filter": (
        'x = { column = "u", filter = { type = "bessel", order = 4, cutoff = 80.0, ripple = 0.5 } }',
        "",
        "ripple in [signals.actuator_command.filter] belongs to a filter of type chebyshev or elliptic only",
    ),
    "negative resolution": ('x = { column = "u", resolution = -1.0 }', "", "at least 0"),
    "stop before start": ('x = { column = "u" }', "start = 3.0\nstop = 2.0\n", "must be after start"),
    "no rows": ('x = { column = "u" }', "start = 30.0\n", "fewer than two rows"),
    "long separator": ('x = { column = "u" }', 'separator = "::"\n', "one character"),
    "one sign for two": ('x = { column = "u" }', 'separator = ","\ndecimal = ","\n', "give each its own"),
    "unknown decimal sign": ('x = { column = "u" }', 'decimal = ";"\n', "decimal is ';'"),
}


@pytest.mark.parametrize("case", WRONG.values(), ids=WRONG)
def test_an_import_map_that_does_not_fit_is_refused_in_one_sentence(
    bring: Any, capsys: Any, case: Any
) -> None:
    rows, top, message = case
    text = table("t,u", TIMES, COMMAND)
    assert bring(text, rows.replace("x =", "actuator_command =") + "\n", f'time = "t"\n{top}')[0] == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


RIPPLING = {
    "chebyshev": ("", LoggerFilter("chebyshev", 5, 80.0, 0.5)),
    "elliptic": (', ripple = 0.2, attenuation = "50 dB"', LoggerFilter("elliptic", 5, 80.0, 0.2, 50.0)),
}


@pytest.mark.parametrize("kind", RIPPLING)
def test_filters_with_a_ripple_can_be_stated(bring: Any, kind: str) -> None:
    more, wanted = RIPPLING[kind]
    stated = f'filter = {{ type = "{kind}", order = 5, cutoff = 80.0{more} }}'
    _, run = bring(table("t,u,y", TIMES, COMMAND, LATE), DRIVE.replace('"y",', f'"y", {stated},'))
    assert known(run).channel("master", "column_displacement").filter == wanted


MOTION = "[ground_motion]\nrecord = 'motion.csv'\nscale = 2.0\n"
BUILDING = 'ground_acceleration = { column = "a" }\ndisplacement = { column = "x" }\n'
STRONG = np.sin(2.0 * np.pi * TIMES) * (TIMES < 3.0)  # m/s²


def test_a_whole_test_keeps_the_ground_motion_of_its_plan(
    bring: Any, call: Any, capsys: Any, tmp_path: Path
) -> None:
    away = tmp_path / "away"
    away.mkdir()
    (tmp_path / "motion.csv").write_text(table("time (s),acceleration (m/s2)", TIMES, 0.5 * STRONG))
    _, run = bring(table("t,a,x", TIMES, STRONG, 1e-3 * LATE), BUILDING, 'time = "t"\n', plan=PLAN + MOTION)
    (tmp_path / "motion.csv").unlink()
    moved = (tmp_path / "a.mcap").rename(away / "a.mcap")
    ground = build(read(moved)).ground
    assert ground is not None
    assert ground[0, : TIMES.size] == pytest.approx(STRONG, abs=1e-8)
    assert run.metadata["ground_motion"]["scale"] == "2.0"
    assert call("replay", moved) == 2
    assert "cannot be replayed: it was imported" in capsys.readouterr().err


def test_a_ground_motion_that_cannot_be_read_is_said_at_import(bring: Any, capsys: Any) -> None:
    data = table("t,a,x", TIMES, STRONG, 1e-3 * LATE)
    code, run = bring(data, BUILDING, 'time = "t"\n', plan=PLAN + MOTION)
    assert code == 0
    assert not run.attachments
    said = capsys.readouterr().out
    assert "ground: the whole test cannot be simulated from this recording: " in said
    assert "motion.csv" in said


def test_the_json_report_states_how_the_data_were_imported(bring: Any, capsys: Any) -> None:
    assert bring(table("t,u,y", 1.05 * TIMES, COMMAND, LATE), DRIVE, 'time = "t"\n', "--json")[0] == 0
    found = json.loads(capsys.readouterr().out)
    assert found["interpolated"] == ["actuator_command", "column_displacement"]
    assert found["link"].startswith("the link cannot be judged")
