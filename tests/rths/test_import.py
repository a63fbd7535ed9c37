"""The import map: units, properties of the logger, the part of the file, its format, and mistaken units or signs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.recording.imported import ImportedData, LoggerFilter, imported
from common.recording.reader import read
from common.recording.run import Run
from diagnosis.recorded import slips
from diagnosis.recorded.record import build
from report.text.tabular import read_table
from report.text.text_form import StatedForm, TextForm

PLAN = '[test]\ninterval = 0.01\nduration = 1.0\n[compensator]\nkind = "none"\n'
TIMES = 0.01 * np.arange(400)
COMMAND = 5.0 * np.sin(2.0 * np.pi * 0.7 * TIMES)  # mm
LATE = 5.0 * np.sin(2.0 * np.pi * 0.7 * (TIMES - 0.045))
FORCE = 12.5 * LATE  # kN at 12.5 kN/mm


def table(
    head: str, *columns: Any, between: str = ",", decimal: str = ".", below: str = "", above: str = ""
) -> str:
    rows = (
        between.join(f"{value:.9f}".replace(".", decimal) for value in row)
        for row in zip(*columns, strict=True)
    )
    return "\n".join([*([above] if above else []), head, *([below] if below else []), *rows]) + "\n"


def known(run: Run) -> ImportedData:
    """The statements of a recording about its import."""
    found = imported(run)
    assert found is not None
    return found


@pytest.fixture
def bring(call: Any, tmp_path: Path) -> Any:
    """Import data under a map; exit code and the recording, None where there is none."""

    def brought(
        data: str, rows: str, top: str = 'time = "t"\n', *more: str, plan: str = PLAN
    ) -> tuple[int, Run | None]:
        (tmp_path / "plan.toml").write_text(plan)
        (tmp_path / "data.csv").write_bytes(data.encode("latin-1"))
        (tmp_path / "map.toml").write_text(f'plan = "plan.toml"\n{top}[signals]\n{rows}')
        out = tmp_path / "a.mcap"
        code = call(
            "import", tmp_path / "data.csv", "--map", tmp_path / "map.toml", "-o", out, "--force", *more
        )
        return code, read(out) if code == 0 else None

    return brought


DRIVE = (
    'actuator_command = { column = "u", unit = "mm" }\ncolumn_displacement = { column = "y", unit = "mm" }\n'
)


def test_units_give_the_scales_and_the_loggers_properties_are_kept(bring: Any) -> None:
    rows = DRIVE + (
        'column_force = { column = "f", unit = "kN", delay = "2 ms", resolution = "0.1 kN", calibration = 0.01, '
        'high_pass = 0.5, filter = { type = "butterworth", order = 4, cutoff = 100.0 } }\n'
    )
    code, run = bring(table("t,u,y,f", TIMES, COMMAND, LATE, FORCE), rows)
    assert code == 0
    assert np.allclose(run.columns["master"]["column_displacement"], 1e-3 * LATE, atol=1e-11)
    assert np.allclose(run.columns["master"]["column_force"], 1e3 * FORCE, atol=1e-5)
    stated = known(run).channel("master", "column_force")
    assert (stated.delay, stated.resolution, stated.calibration) == (0.002, 100.0, 0.01)
    assert stated.filter == LoggerFilter("butterworth", 4, 100.0)
    assert stated.high_pass == 0.5
    assert stated.rate == pytest.approx(100.0)
    assert not stated.interpolated


def test_rows_between_the_ticks_lose_nothing_of_a_motion(bring: Any) -> None:
    rows = np.arange(TIMES.size) / 57.0
    wave = 10.0 * np.sin(2.0 * np.pi * 2.0 * rows)
    code, run = bring(table("t,u,y", rows, wave, wave), DRIVE)
    assert code == 0
    found = run.columns["master"]["column_displacement"]
    expected = 1e-2 * np.sin(2.0 * np.pi * 2.0 * 0.01 * np.arange(found.size))
    assert np.max(np.abs(found - expected)[8:-8]) < 2e-6  # straight lines are off by up to 60 µm


@pytest.mark.parametrize("begun", [0.0, 0.003, -0.003])
def test_what_a_controller_holds_from_tick_to_tick_is_no_curve(bring: Any, begun: float) -> None:
    rows = np.arange(850) / 205.0 + 0.1  # 2.05 rows in an interval
    ticks = np.floor((rows + begun) / 0.01 + 1e-9)
    steps = 5.0 * np.sin(2.0 * np.pi * 0.7 * 0.01 * ticks)
    smooth = 5.0 * np.sin(2.0 * np.pi * 0.7 * rows)
    code, run = bring(table("t,u,y", rows, steps, smooth), DRIVE)
    assert code == 0
    command = run.columns["master"]["actuator_command"]
    expected = 5e-3 * np.sin(2.0 * np.pi * 0.7 * 0.01 * (10.0 + np.arange(command.size)))
    assert np.max(np.abs(command - expected)[1:-1]) < 1e-9
    assert not known(run).channel("master", "actuator_command").interpolated
    assert known(run).channel("master", "column_displacement").interpolated


def test_rows_between_the_ticks_are_marked(bring: Any, capsys: Any) -> None:
    code, run = bring(table("t,u,y", 1.05 * TIMES, COMMAND, LATE), DRIVE)
    assert code == 0
    assert known(run).channel("master", "column_displacement").interpolated
    said = capsys.readouterr().out
    assert "interpolated onto the ticks, and marked so: actuator_command, column_displacement" in said
    assert (
        "link: the link cannot be judged, because the data hold no numbers and no time stamps of messages"
        in said
    )


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
        assert "units, from the row below the names: actuator_command in mm" in said
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


def test_rows_on_the_ticks_keep_their_steps_although_times_are_not_exact(bring: Any) -> None:
    times = TIMES + 12.34567  # whose differences are no whole multiples of an interval
    steps = np.round(COMMAND, 1)
    code, run = bring(table("t,u,y", times, steps, steps), DRIVE)
    assert code == 0
    assert not known(run).channel("master", "column_displacement").interpolated
    assert set(np.unique(run.columns["master"]["column_displacement"])) == set(np.unique(1e-3 * steps))


SLOW = 0.03 * np.arange(134) + 0.004  # s, rows of a channel with a clock of its own
OTHER_RATES = {
    "half as often": (TIMES, slice(1, None, 2), 50.0),
    "of two loggers": (np.unique(np.r_[TIMES, SLOW]), None, 1.0 / 0.03),
}


@pytest.mark.parametrize("case", OTHER_RATES)
def test_a_channel_with_a_rate_of_its_own_has_empty_cells(bring: Any, case: str) -> None:
    times, rows, rate = OTHER_RATES[case]
    motion = 5.0 * np.sin(2.0 * np.pi * 0.7 * times)
    read = np.full(times.size, np.nan)
    there = np.isin(times, SLOW) if rows is None else rows
    read[there] = motion[there]
    commanded = np.where(np.isin(times, TIMES), motion, np.nan)
    text = table("t,u,y", times, commanded, read).replace("nan", "")
    code, run = bring(text, DRIVE)
    assert code == 0
    ticks = run.columns["master"]["t"]
    found = run.columns["master"]["column_displacement"]
    inside = (ticks > 0.1) & (ticks < 3.9)
    expected = 5e-3 * np.sin(2.0 * np.pi * 0.7 * ticks)
    assert np.max(np.abs(found - expected)[inside]) < 2e-7
    assert run.columns["master"]["actuator_command"] == pytest.approx(expected, abs=1e-11)
    channels = [known(run).channel("master", name) for name in ("column_displacement", "actuator_command")]
    assert [one.interpolated for one in channels] == [True, False]
    assert [one.rate for one in channels] == pytest.approx([rate, 100.0])


@pytest.mark.parametrize("holes", [slice(200, 201), slice(200, 260), slice(0, 30), slice(380, None)])
def test_a_channel_with_a_hole_is_refused(bring: Any, capsys: Any, holes: slice) -> None:
    read = LATE.copy()
    read[holes] = np.nan
    assert bring(table("t,u,y", TIMES, COMMAND, read).replace("nan", ""), DRIVE)[0] == 2
    assert "column 'y' has no number in row" in capsys.readouterr().err


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
    assert not known(run).channel("master", "column_displacement").interpolated


def test_sequence_numbers_are_held_between_rows_and_incomplete_time_stamps_are_left_out(
    bring: Any, capsys: Any
) -> None:
    numbers = np.floor(TIMES / 0.02)
    rows = (
        DRIVE
        + 'damper_force_seq = { column = "n" }\ncommand_seq = { column = "n" }\ncommand_one_way = { column = "w" }\n'
    )
    text = table("t,u,y,n,w", 1.01 * TIMES, COMMAND, LATE, numbers, 1e-3 + 0.0 * TIMES)
    code, run = bring(text, rows)
    assert code == 0
    assert set(np.unique(run.columns["master"]["damper_force_seq"])) <= set(range(200))
    assert np.all(run.columns["latency"]["command_one_way"] == 1e-3)
    assert np.all(np.isnan(run.columns["latency"]["round_trip"]))
    assert "link:" not in capsys.readouterr().out


SLIPS = {
    "millimetres for metres": (
        1e3 * LATE,
        FORCE,
        "'column_displacement' is 1.01e+03 times what the plan predicts",
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


def test_a_force_without_a_command_is_checked_against_the_measured_deformation(
    bring: Any, capsys: Any
) -> None:
    rows = 'column_displacement = { column = "y" }\ncolumn_force = { column = "f", unit = "kN" }\n'
    assert bring(table("t,y,f", TIMES, LATE, FORCE), rows)[0] == 2
    assert (
        "'column_force' is 1/1e+03 of what the plan predicts from column_displacement"
        in capsys.readouterr().err
    )


WRONG = {
    "unit of another quantity": (
        'x = { column = "u", unit = "kN" }',
        "",
        "'actuator_command' in [signals] is in kN",
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
