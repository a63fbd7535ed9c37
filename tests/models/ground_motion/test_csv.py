from pathlib import Path

import numpy as np
import pytest

from common.errors import InputError
from models.ground_motion import read_csv

ROWS = "0.00,0.0\n0.02,1.5\n0.04,-2.5\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("g", 9.80665),
        ("G", 9.80665),
        ("gal", 0.01),
        ("Gal", 0.01),
        ("cm/s2", 0.01),
        ("cm/s^2", 0.01),
        ("m/s2", 1.0),
        ("m/s²", 1.0),
        ("m/s**2", 1.0),
        (" mm/s2 ", 0.001),
    ],
)
def test_the_unit_of_the_header_is_applied(tmp_path: Path, unit: str, factor: float) -> None:
    motion = read_csv(written(tmp_path, f"time (s),acceleration ({unit})\n{ROWS}"))
    assert (motion.name, motion.interval) == ("mine", 0.02)
    np.testing.assert_allclose(motion.acceleration, factor * np.array([0.0, 1.5, -2.5]), rtol=1e-15)


@pytest.mark.parametrize("separator", [",", ";", "\t", " , "])
def test_commas_semicolons_and_tabs_separate_the_columns(tmp_path: Path, separator: str) -> None:
    text = f"time (s),acceleration (g)\n{ROWS}".replace(",", separator)
    assert read_csv(written(tmp_path, text)).points == 3


def test_comments_empty_lines_quotes_and_byte_order_marks_are_accepted(tmp_path: Path) -> None:
    text = f'\ufeff# station 7\n\n"time","acceleration (g)"\n# shaking\n{ROWS}\n\n'
    assert read_csv(written(tmp_path, text)).points == 3


def test_a_record_that_does_not_begin_at_zero_keeps_its_interval(tmp_path: Path) -> None:
    motion = read_csv(written(tmp_path, "time (s),acceleration (g)\n5.01,1\n5.02,2\n5.03,3\n"))
    assert motion.interval == 0.01
    assert motion.points == 3


def test_rounded_times_count_as_equally_spaced(tmp_path: Path) -> None:
    rows = "".join(f"{k / 128:.4f},{k % 3}\n" for k in range(257))
    motion = read_csv(written(tmp_path, f"time (s),acceleration (g)\n{rows}"))
    assert motion.interval == pytest.approx(1 / 128, rel=1e-12)


HEADER = "time (s),acceleration (g)\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "mine.csv is empty: write a first line such as: time"),
        ("# nothing but a remark\n", "mine.csv is empty"),
        ("time,a_g\n" + ROWS, "'a_g' at .*:1 may be a ground acceleration or an acceleration in g"),
        (
            "time,drift\n" + ROWS,
            "'drift' at .*:1 is neither time nor acceleration: name it as one of time, t or s",
        ),
        ("time,t\n" + ROWS, "columns at .*:1 must be time and acceleration"),
        (
            "0,00;0,1\n0,02;0,2\n",
            "mine.csv:1 seem to have decimal commas: write numbers with a decimal point",
        ),
        ("0,00 0,1\n0,02 0,2\n", "mine.csv:1 holds 3 columns.*where these are decimal commas"),
        ("0,00,0,1\n0,02,0,2\n", "mine.csv:1 holds 4 columns.*where these are decimal commas"),
        ("0,1\n0,2\n", "time at .*mine.csv:2 does not increase.*where these are decimal commas"),
        ("0.0 0.1 0.2\n", "mine.csv:1 holds 3 columns, but must hold time and acceleration, or"),
        ("time (s),acceleration (ft/s2)\n" + ROWS, "Unit 'ft/s2' at .*:1 is none of g, gal"),
        ("time (min),acceleration (g)\n" + ROWS, "time at .*:1 must be in seconds"),
        ("acceleration (g)\n0.1\n0.2\n", "holds one column: give the time between its samples in s as dt"),
        (HEADER + "0.0,0.1\n0.02\n", "mine.csv:3 holds 1 column,"),
        (HEADER + "0.0,0.1,0.2\n", "mine.csv:2 holds 3 columns,"),
        (HEADER + "0.0,0.1\n0.02,\n", "The acceleration is missing at .*mine.csv:3"),
        (HEADER + "0.0,0.1\n ,0.3\n", "The time is missing at .*mine.csv:3"),
        (HEADER + "0.0,0.1\n0.02,high\n", "'high' at .*mine.csv:3 is not a number"),
        (HEADER + "0.0,0.1\n0.02,nan\n", "mine.csv:3 is nan, but must be finite"),
        (HEADER + "0.0,0.1\n", "holds fewer than two samples"),
        (HEADER, "holds fewer than two samples"),
        (HEADER + "0.0,1\n0.02,1\n0.02,1\n", "time at .*mine.csv:4 does not increase"),
        (HEADER + "0.0,1\n0.02,1\n0.01,1\n", "time at .*mine.csv:4 does not increase"),
        (HEADER + "0.0,1\n0.02,1\n0.04,1\n0.08,1\n0.10,1\n", "mine.csv:5 comes 0.04 s after.*it is 0.02 s"),
    ],
)
def test_an_error_in_a_csv_record_is_named_with_its_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_csv(written(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "factor"),
    [
        ("0.00 0.0\n0.02 1.5\n0.04 -2.5\n", 1.0),
        ("  0.00   0.0\n  0.02   1.5\n  0.04  -2.5\n", 1.0),
        ("0.00\t0.0\n0.02\t1.5\n0.04\t-2.5\n", 1.0),
        (ROWS, 1.0),
        ("time,acc\n" + ROWS, 1.0),
        ("time,acceleration_m_s2\n" + ROWS, 1.0),
        ("t,ag\n" + ROWS, 1.0),
        ("t [s];a [mm/s^2]\n" + ROWS.replace(",", ";"), 1e-3),
        ("time_s,acc_g\n" + ROWS, 9.80665),
        ("time (s) acceleration (cm/s2)\n" + ROWS.replace(",", " "), 0.01),
        ("Time\tAcceleration, cm/s/s\n" + ROWS.replace(",", "\t"), 0.01),
        ("time (ms),accel/gal\n0,0\n20,1.5\n40,-2.5\n", 0.01),
        ("acceleration (m/s2),time (s)\n0.0,0.00\n1.5,0.02\n-2.5,0.04\n", 1.0),
        ("% a remark\n// another\ntime,ground_acceleration_g\n" + ROWS, 9.80665),
    ],
)
def test_columns_in_many_layouts_are_read(tmp_path: Path, text: str, factor: float) -> None:
    motion = read_csv(written(tmp_path, text))
    assert motion.interval == pytest.approx(0.02, rel=1e-12)
    np.testing.assert_allclose(motion.acceleration, factor * np.array([0.0, 1.5, -2.5]), rtol=1e-15)


@pytest.mark.parametrize(
    "text", ["0.0\n1.5\n-2.5\n", "acceleration\n0.0\n1.5\n-2.5\n", "acc (m/s2)\n0.0\n1.5\n-2.5\n"]
)
def test_one_column_takes_its_interval_from_the_plan(tmp_path: Path, text: str) -> None:
    motion = read_csv(written(tmp_path, text), dt=0.01)
    assert (motion.interval, motion.acceleration.tolist()) == (0.01, [0.0, 1.5, -2.5])


def test_interval_and_unit_of_the_plan_must_agree_with_the_file(tmp_path: Path) -> None:
    path = written(tmp_path, "time,acc (g)\n" + ROWS)
    assert read_csv(path, dt=0.02, unit="g").points == 3
    assert read_csv(written(tmp_path, ROWS), unit="gal").peak == pytest.approx(0.025)
    path = written(tmp_path, "time,acc (g)\n" + ROWS)
    with pytest.raises(InputError, match="says that its acceleration is in g, and unit in .* says gal"):
        read_csv(path, unit="gal")
    with pytest.raises(InputError, match="come every 0.02 s, and dt in .ground_motion. is 0.01 s"):
        read_csv(path, dt=0.01)
