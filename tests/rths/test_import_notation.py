"""Numbers in groups of thousands and times of 12 hours: read as they are stated, and never misread in silence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError
from report.text.cells import Notation, times
from report.text.decimals import fixed_decimals
from report.text.tabular import read_table
from report.text.text_form import StatedForm
from tests.rths.imports import DRIVE

SOUGHT = ("t", "u")
VALUES = [1234.5, -1234567.0, 12.25]
APOSTROPHES = ["'", "\u2019", "\x92"]
SPACES = [" ", "\u00a0", "\u2009", "\u202f"]


def read(text: str, tmp_path: Path, **stated: Any) -> dict[str, Any]:
    path = tmp_path / "data.csv"
    path.write_text(text, encoding="utf-8")
    return {
        name: column.tolist()
        for name, column in read_table(path, StatedForm(columns=SOUGHT, **stated)).columns.items()
    }


def written(mark: str, separator: str, decimal: str) -> str:
    cells = [f"1{mark}234.5", f"-1{mark}234{mark}567", "12.25"]
    rows = [f"0.{k}{separator}{cell}\n" for k, cell in enumerate(cells)]
    return f"t{separator}u\n" + "".join(rows).replace(".", decimal)


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("mark", [*APOSTROPHES, *SPACES])
def test_thousands_parted_by_apostrophes_or_spaces_are_read_where_stated_and_refused_elsewhere(
    mark: str, decimal: str, separator: str, tmp_path: Path
) -> None:
    text = written(mark, separator, decimal)
    key, said = ("'", "apostrophes") if mark in APOSTROPHES else (" ", "spaces")
    assert read(text, tmp_path, thousands=key)["u"] == VALUES
    with pytest.raises(InputError) as refused:
        read(text, tmp_path)
    assert f'are parted by {said}: give thousands = "{key}" in the map.' in str(refused.value)


def test_one_group_among_many_plain_numbers_is_no_hole(tmp_path: Path) -> None:
    rows = "".join(f"{k},{k}.5\n" for k in range(300))
    text = f"t,u\n{rows}300,1'234.5\n"
    with pytest.raises(InputError, match="parted by apostrophes"):
        read(text, tmp_path)
    assert read(text, tmp_path, thousands="'")["u"][-1] == 1234.5


@pytest.mark.parametrize("mark", ["'", ","])
def test_groups_behind_a_long_beginning_without_any_are_read(mark: str, tmp_path: Path) -> None:
    rows = "".join(f"{k};{k % 900}.5\n" for k in range(150_000))  # more than a reader looks at to tell texts
    found = read(f"t;u\n{rows}150000;1{mark}234.5\n", tmp_path, thousands=mark)["u"]
    assert found[-2:] == [599.5, 1234.5]


def test_fractions_of_three_digits_are_no_thousands(tmp_path: Path) -> None:
    text = "t;u\n0,000;1,234\n0,001;1,235\n0,002;-1,236\n"
    assert read(text, tmp_path) == {"t": [0.0, 0.001, 0.002], "u": [1.234, 1.235, -1.236]}


def test_numbers_that_may_be_either_are_refused_until_one_sign_is_stated(tmp_path: Path) -> None:
    text = "t;u\n1;1,234\n2;2,345\n"
    with pytest.raises(InputError) as refused:
        read(text, tmp_path)
    assert (
        "column 'u' holds '1,234', which is 1234 or 1.234: give thousands = \",\" or decimal = \",\" in the map"
        in str(refused.value)
    )
    assert read(text, tmp_path, decimal=",")["u"] == [1.234, 2.345]
    assert read(text, tmp_path, decimal=".")["u"] == [1234.0, 2345.0]
    assert read(text, tmp_path, thousands=",")["u"] == [1234.0, 2345.0]


def test_quoted_cells_may_have_the_separator_between_their_thousands(tmp_path: Path) -> None:
    text = 't,u\n0.0,"1,234"\n0.1,"2,345"\n'
    assert read(text, tmp_path, thousands=",")["u"] == [1234.0, 2345.0]


def test_a_cell_with_the_other_decimal_sign_is_no_hole(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="'12,5', but points are read as decimal signs: give decimal = "):
        read("t;u\n0.0;12,5\n0.1;1.5\n0.2;-1.5\n", tmp_path)


def test_columns_that_are_not_looked_for_may_hold_anything(tmp_path: Path) -> None:
    assert read("t,u,serial\n0,1.5,1'234\n1,2.5,1'235\n", tmp_path)["u"] == [1.5, 2.5]


@pytest.mark.parametrize(
    ("top", "said"),
    [
        ('thousands = "_"', "thousands is '_', but must be one of"),
        ('thousands = ","\ndecimal = ","', "decimal and thousands are both ','"),
        ('thousands = " "\nseparator = " "', "separator and thousands are both ' '"),
    ],
)
def test_signs_that_contradict_each_other_are_refused(top: str, said: str, bring: Any, capsys: Any) -> None:
    assert bring("t,u,y\n0,1,2\n", DRIVE, f'time = "t"\n{top}\n')[0] == 2
    assert said in capsys.readouterr().err


def test_the_import_says_what_parts_thousands(bring: Any, capsys: Any) -> None:
    rows = "".join(f"{0.01 * k:.2f};1'000.{k % 7};1'000.{k % 7}\n" for k in range(50))
    code, run = bring(f"t;u;y\n{rows}", DRIVE, 'time = "t"\nthousands = "\'"\n', "--as-is")
    assert code == 0
    assert run.columns["master"]["actuator_command"][3] == pytest.approx(1.0003)
    assert "decimal sign '.', thousands parted by ''', 0 rows above the names" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("cells", "seconds"),
    [
        (["11:59:59 AM", "12:00:00 PM", "12:00:00.5 PM"], [0.0, 1.0, 1.5]),
        (["11:59:59PM", "12:00:00am", "1:00:00 am"], [0.0, 1.0, 3601.0]),  # past midnight
        (["11:59:59 p. m.", "12:00:01 a.m."], [0.0, 2.0]),
        (["2024-02-28 11:59:59\u202fPM", "2024-02-29 12:00:00\u202fAM"], [0.0, 1.0]),
        (["13:00:00 PM", "1:00:00 PM"], None),
        (["0:00:00 AM", "1:00:00 AM"], None),
        (["11:59:59 AM", "12:00:00"], None),
    ],
)
def test_times_of_twelve_hours_are_read(cells: list[str], seconds: list[float] | None) -> None:
    found = times(cells)
    assert (None if found is None else found.tolist()) == seconds


def test_a_time_that_cannot_be_read_is_shown(bring: Any, capsys: Any) -> None:
    rows = "".join(f"2/29/2024 1:00:{k:02d} PM,{k},{k}\n" for k in range(20))
    assert bring(f"t,u,y\n{rows}", DRIVE)[0] == 2
    said = capsys.readouterr().err
    assert (
        "column 't' holds texts such as '2/29/2024 1:00:00 PM', but must hold numbers, or times of day"
        in said
    )


def test_thousands_are_for_texts_only(bring: Any, tmp_path: Path, capsys: Any, call: Any) -> None:
    bring("t,u,y\n0,1,2\n", DRIVE, 'time = "t"\nthousands = ","\n')
    np.savez(tmp_path / "data.npz", t=[0.0, 1.0])
    capsys.readouterr()
    words = ("import", tmp_path / "data.npz", "--map", tmp_path / "map.toml", "-o", tmp_path / "b.mcap")
    assert call(*words) == 2
    assert "is no text: leave out separator, decimal, thousands and skip_rows" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("cells", "decimals"),
    [
        (["1.50", "-0.25", "12.00"], 2),
        (["15", "-2", "1200"], 0),
        (["1.5", "-0.25", "12.0"], None),  # a program that leaves out zeros at the end
        (["1.51", "-0.25", "12.37"], None),  # where no zero stands at an end it may leave them out
        (["1.50e-3", "2.25e-3", "1.00e-2"], None),
    ],
)
def test_decimals_are_fixed_where_all_numbers_have_as_many(cells: list[str], decimals: int | None) -> None:
    rows = [["text", cell] for cell in cells * 20]
    found = fixed_decimals(rows, ["name", "value"], Notation())
    assert found == ({} if decimals is None else {"value": decimals})
    assert fixed_decimals(rows[:3], ["name", "value"], Notation()) == {}  # too few to tell


def test_decimals_of_a_decimal_comma_are_counted_behind_it() -> None:
    rows = [[cell.replace(".", ",")] for cell in ["1.50", "-0.25", "12.00"] * 20]
    assert fixed_decimals(rows, ["value"], Notation(",")) == {"value": 2}
