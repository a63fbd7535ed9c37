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
def test_commas_semicolons_and_tabs_part_the_columns(tmp_path: Path, separator: str) -> None:
    text = f"time (s),acceleration (g)\n{ROWS}".replace(",", separator)
    assert read_csv(written(tmp_path, text)).points == 3


def test_comments_empty_lines_quotes_and_byte_order_marks_do_no_harm(tmp_path: Path) -> None:
    text = f'\ufeff# station 7\n\n"time","acceleration (g)"\n# shaking\n{ROWS}\n\n'
    assert read_csv(written(tmp_path, text)).points == 3


def test_a_record_that_does_not_begin_at_zero_keeps_its_interval(tmp_path: Path) -> None:
    motion = read_csv(written(tmp_path, "time (s),acceleration (g)\n5.01,1\n5.02,2\n5.03,3\n"))
    assert motion.interval == 0.01
    assert motion.points == 3


def test_times_rounded_when_written_are_even(tmp_path: Path) -> None:
    rows = "".join(f"{k / 128:.4f},{k % 3}\n" for k in range(257))
    motion = read_csv(written(tmp_path, f"time (s),acceleration (g)\n{rows}"))
    assert motion.interval == pytest.approx(1 / 128, rel=1e-12)


HEADER = "time (s),acceleration (g)\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "mine.csv is empty: write a first line such as: time"),
        (ROWS, "mine.csv:1 names no unit of the acceleration .*write a first line such as"),
        ("time (s),acceleration\n" + ROWS, "mine.csv:1 names no unit"),
        ("time (s),acceleration (ft/s2)\n" + ROWS, "Unit 'ft/s2' at .*:1 is none of g, gal"),
        ("time (ms),acceleration (g)\n" + ROWS, "time at .*:1 must be in seconds"),
        ("acceleration (g)\n0.1\n0.2\n", "mine.csv:1 holds 1 column, but must hold time and acceleration"),
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
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_csv(written(tmp_path, text))
