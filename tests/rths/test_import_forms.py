"""Text and array files as loggers, spreadsheets and programs write them: what is read of each, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from report.text.cells import Notation, number, times
from report.text.tabular import read_table
from tests.rths.imports import COMMAND, DRIVE, LATE, TIMES, table

ROWS = {"t": [0.0, 0.1, 0.2, 0.3], "u": [1.5, -2.5, 1234.5, 0.25]}


@pytest.mark.parametrize(
    "text",
    [
        "t,u\n0,1.5\n0.1,-2.5\n0.2,1234.5\n0.3,0.25\n",
        "# t u\n0.0 1.5\n0.1 -2.5\n0.2 1234.5\n0.3 0.25\n",  # as numpy.savetxt writes it
        "%t\tu\n0.0\t1.5\n0.1\t-2.5\n0.2\t1234.5\n0.3\t0.25\n",
        "   t    u\n 0.0D+00  1.5D+00\n 1.0D-01 -2.5D+00\n 2.0d-01  1.2345D3\n 3.0D-01  0.25\n",  # Fortran
        "t;u\n0,0;1,5\n0,1;-2,5\n0,2;1.234,5\n0,3;0,25\n",  # thousands
        "t;u\n0.0;1.5\n0.1;-2.5\n0.2;1,234.5\n0.3;0.25\n",
        "t,u\n23:59:59.9,1.5\n0:00:00.0,-2.5\n00:00:00.1,1234.5\n00:00:00.2,0.25\n",  # past midnight
        "t,u\n2024-02-29T23:59:59.900,1.5\n2024-03-01 00:00:00.000,-2.5\n2024-03-01T00:00:00.100,1234.5\n"
        "2024-03-01T00:00:00.200,0.25\n",
        "t,u\n0,1.5\n0.1,-2.5\n0.2,1234.5\n0.3,0.25\n\nEnd of test\nOperator: X\n",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_texts_hold_the_same_numbers_however_they_are_written(
    text: str, encoding: str, tmp_path: Path
) -> None:
    path = tmp_path / "data.txt"
    path.write_bytes(text.encode(encoding))
    found = read_table(path).columns
    assert set(found) == set(ROWS)
    for name, values in ROWS.items():
        assert found[name] == pytest.approx(values, abs=1e-9)


def test_a_cell_with_an_error_is_no_number_and_leaves_its_column(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("t,u,name\n0,1.5,a\n0.1,#NUM!,b\n0.2,2.5,c\n")
    found = read_table(path).columns
    assert set(found) == {"t", "u"}
    assert np.array_equal(found["u"], [1.5, np.nan, 2.5], equal_nan=True)


@pytest.mark.parametrize("above", ["", "Run 7\nBench A\n"])
@pytest.mark.parametrize("below", ["", "s,mm,mm\n"])
@pytest.mark.parametrize("behind", [1, 2, 5])
def test_rows_with_another_number_of_cells_are_refused_between_others(
    above: str, below: str, behind: int, bring: Any, capsys: Any
) -> None:
    rows = [f"{0.01 * k:.2f},1,2\n" for k in range(8)]
    rows.insert(len(rows) - behind, "segment 2\n")
    code, _ = bring(f"{above}t,u,y\n{below}{''.join(rows)}", DRIVE)
    assert code == 2
    assert "Expected 3 columns, got 1: segment 2" in capsys.readouterr().err


def test_lines_behind_the_last_row_are_left_out_below_a_preamble_and_a_row_of_units(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("Run 7\nt,u\ns,mm\n0,1\n0.1,2\n0.2,3\n\nEnd of test\nMax\n")
    assert read_table(path).columns["u"].tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("ending", [".mat", ".npz"])
def test_columns_of_a_matrix_have_the_names_by_which_they_are_taken_out(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"data{ending}"
    both = np.column_stack(list(ROWS.values()))
    arrays = {"X": both, "Y": both.T, "t": np.array(ROWS["t"])[:, None]}
    if ending == ".mat":
        savemat(path, arrays | {"log": {"u": ROWS["u"], "by": "X"}})
        names = {"X(:,1)": "t", "X(:,2)": "u", "Y(1,:)": "t", "Y(2,:)": "u", "t": "t", "log.u": "u"}
    else:
        np.savez(path, X=arrays["X"], Y=arrays["Y"], t=arrays["t"])
        names = {"X[:,0]": "t", "X[:,1]": "u", "Y[0,:]": "t", "Y[1,:]": "u", "t": "t"}
    found = read_table(path).columns
    assert {name: values.tolist() for name, values in found.items()} == {
        name: ROWS[column] for name, column in names.items()
    }


def test_a_unit_in_brackets_in_a_name_is_taken_and_said(bring: Any, capsys: Any) -> None:
    rows = 'actuator_command = { column = "u [mm]" }\ncolumn_displacement = { column = "y (mm)" }\n'
    code, run = bring(table("t (s),u [mm],y (mm)", TIMES, COMMAND, LATE), rows, 'time = "t (s)"\n')
    assert code == 0
    assert np.allclose(run.columns["master"]["column_displacement"], 1e-3 * LATE, atol=1e-11)
    said = capsys.readouterr().out
    assert "actuator_command in mm, column_displacement in mm" in said


def test_brackets_without_a_unit_say_nothing(bring: Any) -> None:
    rows = (
        'actuator_command = { column = "u", unit = "mm" }\ncolumn_displacement = { column = "y (LVDT2)" }\n'
    )
    code, run = bring(table("t,u,y (LVDT2)", TIMES, COMMAND, 1e-3 * LATE), rows)
    assert code == 0
    assert np.allclose(run.columns["master"]["column_displacement"], 1e-3 * LATE, atol=1e-11)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("t,u,y,y\n0,1,2,3\n0.01,1,2,3\n", "has more than one column 'y': give each a name of its own"),
        ("0.1,1,2\n0.2,1,2\n", "has no row of names: write one above the numbers, with 't' in it"),
        ("t,u,y\n0.0,1,2\n0.0,2,3\n0.1,3,4\n", "It may be printed with too few digits: give rate"),
        ("t,u,y\n0.0,1,2\n0.1,2,3\n0.05,3,4\n", "does not increase at row 3.\n"),
    ],
)
def test_a_table_that_says_too_little_is_refused_in_one_sentence(
    data: str, said: str, bring: Any, capsys: Any
) -> None:
    code, _ = bring(data, DRIVE)
    assert code == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("cell", "decimal", "value"),
    [
        ("1.5", ".", 1.5),
        ("1,5", ",", 1.5),
        ("1.5", ",", None),
        ("1,234.5", ".", 1234.5),
        ("1,23.5", ".", None),
        ("1_000", ".", None),
        ("-1.5D-03", ".", -1.5e-3),
        ("nan", ".", float("nan")),
        ("12:30:00", ".", None),
        ("", ".", None),
    ],
)
def test_a_cell_holds_a_number_or_none(cell: str, decimal: str, value: float | None) -> None:
    assert number(cell, Notation(decimal)) == (None if value is None else pytest.approx(value, nan_ok=True))


def test_times_are_those_of_all_cells_or_none() -> None:
    assert times(["12:30:00", "12:30:00,5"]).tolist() == [0.0, 0.5]  # type: ignore[union-attr]
    assert times(["12:30:00", "1.5"]) is None
    assert times([]) is None
