from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from common.errors import InputError
from models.ground_motion import STANDARD_GRAVITY, read_at2

TITLE = "PEER NGA STRONG MOTION DATABASE RECORD\nSomewhere,  1/2/2003, Station, 90"
UNITS = "ACCELERATION TIME SERIES IN UNITS OF G"
VALUES = "  .1000000E+00  -.2000000E+00\n  .3000000E-01"


def written(
    folder: Path, sampling: str = "NPTS= 3, DT= .0100 SEC", units: str = UNITS, values: str = VALUES
) -> Path:
    path = folder / "some.AT2"
    path.write_text(f"{TITLE}\n{units}\n{sampling}\n{values}\n")
    return path


@pytest.mark.parametrize(
    "sampling",
    [
        "NPTS=      3, DT=   .0100 SEC,          ",
        "NPTS=   3, DT=   .0100 SEC",
        "NPTS=3,DT=0.01",
        "npts = 3 , dt = 1.0E-2 sec",
        "NPTS: 3, DT: 0.01",
        "   3    0.0100    NPTS, DT",
        "3, 0.0100 NPTS, DT",
    ],
)
def test_every_form_of_the_sampling_line_is_read(tmp_path: Path, sampling: str) -> None:
    motion = read_at2(written(tmp_path, sampling))
    assert motion.interval == 0.01
    np.testing.assert_allclose(
        motion.acceleration, STANDARD_GRAVITY * np.array([0.1, -0.2, 0.03]), rtol=1e-15
    )


def test_the_name_is_the_second_line_and_the_version_follows_from_the_file(tmp_path: Path) -> None:
    motion = read_at2(written(tmp_path))
    assert motion.name == "Somewhere, 1/2/2003, Station, 90"
    assert motion.version.startswith("file some.AT2, digest ")


def test_two_contents_of_one_name_have_two_versions(tmp_path: Path) -> None:
    first = read_at2(written(tmp_path)).version
    assert first == read_at2(written(tmp_path)).version
    assert first != read_at2(written(tmp_path, values="0.1 0.2 0.30001")).version


def test_windows_line_ends_are_read(tmp_path: Path) -> None:
    path = written(tmp_path)
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert read_at2(path).points == 3


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    values=st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=40),
    interval=st.sampled_from([0.005, 0.01, 0.02, 1 / 128]),
    columns=st.integers(1, 8),
)
def test_values_are_read_with_any_wrapping_of_lines(
    tmp_path: Path, values: list[float], interval: float, columns: int
) -> None:
    rows = [values[i : i + columns] for i in range(0, len(values), columns)]
    text = "\n".join(" ".join(f"{value:.17e}" for value in row) for row in rows)
    motion = read_at2(written(tmp_path, f"NPTS= {len(values)}, DT= {interval!r} SEC", values=text))
    assert motion.interval == interval
    np.testing.assert_array_equal(motion.acceleration, STANDARD_GRAVITY * np.array(values))


@pytest.mark.parametrize(
    ("sampling", "words"),
    [
        ("DT= .01 SEC", "some.AT2:4 does not give NPTS"),
        ("NPTS= 3", "some.AT2:4 does not give DT"),
        ("", "does not give NPTS"),
        ("NPTS= 3, DT= 0.0 SEC", "DT at .*:4 is 0.0 s, but must be above 0"),
        ("NPTS= 3, DT= -.01 SEC", "DT at .*:4 is -.01 s"),
        ("NPTS= 3, DT= nan SEC", "value at .*:4 is nan, but must be finite"),
        ("NPTS= 3, DT= fast SEC", "'fast' at .*:4 is not a number"),
        ("NPTS= three, DT= .01 SEC", "'three' at .*:4 is not a number"),
        ("NPTS= 2.5, DT= .01 SEC", "NPTS at .*:4 is 2.5, but must be a whole number of at least 2"),
        ("NPTS= 1, DT= .01 SEC", "NPTS at .*:4 is 1"),
        ("NPTS= 4, DT= .01 SEC", "announces NPTS = 4 in line 4 but holds 3 values"),
        ("NPTS= 2, DT= .01 SEC", "announces NPTS = 2 in line 4 but holds 3 values"),
    ],
)
def test_a_wrong_sampling_line_is_named(tmp_path: Path, sampling: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_at2(written(tmp_path, sampling))


@pytest.mark.parametrize("units", ["ACCELERATION IN UNITS OF CM/S**2", "UNITS OF GAL", "UNITS OF G/10", ""])
def test_only_records_in_g_are_accepted(tmp_path: Path, units: str) -> None:
    with pytest.raises(InputError, match=r"some\.AT2:3 does not say UNITS OF G"):
        read_at2(written(tmp_path, units=units))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (".1 .2\n.x3", "'.x3' at .*some.AT2:6 is not a number"),
        (".1\n1_000 .2", "'1_000' at .*some.AT2:6 is not a number"),
        (".1\n.2\nNaN", "some.AT2:7 is NaN, but must be finite"),
        ("inf .2 .3", "some.AT2:5 is inf, but must be finite"),
    ],
)
def test_a_wrong_value_is_named_with_its_line(tmp_path: Path, values: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_at2(written(tmp_path, values=values))


def test_a_file_without_values_is_named(tmp_path: Path) -> None:
    path = tmp_path / "short.AT2"
    path.write_text("one\ntwo\n")
    with pytest.raises(InputError, match=r"short\.AT2 ends within the four header lines"):
        read_at2(path)


def test_an_unreadable_path_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"Cannot read ground motion .*: Is a directory"):
        read_at2(tmp_path)
