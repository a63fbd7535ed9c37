"""Rows of a static test: which are read, the zero and the sign of a sensor, and rows without a number."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.rths.imports import COMMAND, FORCE, LATE, PLAN, TIMES, table

ROWS = (
    'column_displacement = { column = "y", unit = "mm"%s }\ncolumn_force = { column = "f", unit = "kN"%s }\n'
)
STATIC = "static = true\n"
ALONE = PLAN + "[slave]\nkind = 'none'\n"


def test_rows_by_number_are_those_that_are_read(bring: Any) -> None:
    head = STATIC + "first_row = 11\nlast_row = 60\n"
    code, run = bring(table("y,f", COMMAND, 12.5 * COMMAND), ROWS % ("", ""), head, plan=ALONE)
    assert code == 0
    assert run.columns["master"]["column_displacement"] == pytest.approx(1e-3 * COMMAND[10:60], abs=1e-11)


def test_a_reading_of_the_opposite_sign_and_its_zero_have_units(bring: Any) -> None:
    more = (', scale = -1, offset = "0.25 mm"', ', scale = -1, offset = "-2 kN"')
    data = table("y,f", -(COMMAND - 0.25), -12.5 * (COMMAND + 0.16))
    code, run = bring(data, ROWS % more, STATIC, plan=ALONE)
    assert code == 0
    assert run.columns["master"]["column_displacement"] == pytest.approx(1e-3 * COMMAND, abs=1e-11)
    assert run.columns["master"]["column_force"] == pytest.approx(12.5e3 * COMMAND, abs=1e-4)


def test_a_few_rows_without_a_number_are_left_out_and_said(bring: Any, capsys: Any) -> None:
    force = 12.5 * COMMAND
    force[[7, 90]] = np.nan
    code, run = bring(table("y,f", COMMAND, force), ROWS % ("", ""), STATIC, plan=ALONE)
    assert code == 0
    assert "left out, as a column has no number there: 2 rows" in capsys.readouterr().out
    kept = np.delete(COMMAND, [7, 90])
    assert run.columns["master"]["column_displacement"] == pytest.approx(1e-3 * kept, abs=1e-11)


def test_more_rows_without_a_number_are_refused(bring: Any, capsys: Any) -> None:
    force = 12.5 * COMMAND
    force[::9] = np.nan
    assert bring(table("y,f", COMMAND, force), ROWS % ("", ""), STATIC, plan=ALONE)[0] == 2
    assert "column 'f' has no number in row 1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("head", "says"),
    [
        ("rate = 100.0\nfirst_row = 3\n", "first_row and last_row are for static = true"),
        (STATIC + "first_row = 400\n", "fewer than two rows lie between first_row and last_row"),
        (STATIC + "start = 1.0\n", "or first_row and last_row of a static test"),
    ],
)
def test_rows_that_cannot_be_are_refused(head: str, says: str, bring: Any, capsys: Any) -> None:
    data = table("t,y,f", TIMES, LATE, FORCE)
    assert bring(data, ROWS % ("", ""), head, plan=ALONE)[0] == 2
    assert says in capsys.readouterr().err
