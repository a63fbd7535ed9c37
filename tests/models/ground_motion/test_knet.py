from pathlib import Path

import numpy as np
import pytest

from common.errors import InputError
from models.ground_motion import read_knet

HEADER = """\
Origin Time       2006/01/18 23:25:00
Lat.              37.798
Long.             142.200
Depth. (km)       36
Mag.              5.7
Station Code      MYG002
Station Lat.      38.7262
Station Long.     141.5109
Station Height(m) 79
Record Time       2006/01/18 23:25:46
Sampling Freq(Hz) 100Hz
Duration Time(s)  2
Dir.              N-S
Scale Factor      3920(gal)/6170270
Max. Acc. (gal)   48.060
Last Correction   2006/01/18 23:25:31
Memo.             """
OFFSET = 8003
COUNTS = np.round(1e5 * np.sin(2.0 * np.pi * 3.0 * 0.01 * np.arange(200))).astype(int)  # six whole periods


def written(folder: Path, replacements: dict[str, str] | None = None, counts: str | None = None) -> Path:
    header = HEADER
    for old, new in (replacements or {}).items():
        assert old in header
        header = header.replace(old, new)
    if counts is None:
        rows = (COUNTS + OFFSET).reshape(-1, 8)
        counts = "\n".join("".join(f"{count:9d}" for count in row) for row in rows)
    path = folder / "MYG0020601182325.NS"
    path.write_text(f"{header}\n{counts}\n")
    return path


def test_counts_become_accelerations_without_the_offset(tmp_path: Path) -> None:
    motion = read_knet(written(tmp_path))
    assert (motion.interval, motion.points) == (0.01, 200)
    gal_per_count = 3920.0 / 6170270.0
    expected = 0.01 * gal_per_count * (COUNTS - COUNTS.mean())
    np.testing.assert_allclose(motion.acceleration, expected, rtol=0.0, atol=1e-12)
    assert motion.peak == pytest.approx(1e5 * 3920.0 / 6170270.0 / 100.0, rel=2e-3)
    assert motion.acceleration.mean() == pytest.approx(0.0, abs=1e-15)


def test_the_name_contains_station_direction_and_event(tmp_path: Path) -> None:
    motion = read_knet(written(tmp_path))
    assert motion.name == "MYG002 N-S, 2006/01/18 23:25:00"
    assert motion.version.startswith("file MYG0020601182325.NS, digest ")


def test_kik_net_channels_are_spelled_out(tmp_path: Path) -> None:
    replacements = {
        "Dir.              N-S": "Dir.              4",
        "100Hz": "200Hz",
        "Duration Time(s)  2": "Duration Time(s)  1",
        "3920(gal)/6170270": "2000(gal)/8388608",
    }
    motion = read_knet(written(tmp_path, replacements))
    assert motion.name == "MYG002 N-S surface, 2006/01/18 23:25:00"
    assert motion.interval == 0.005
    expected = 20.0 / 8388608 * (COUNTS - COUNTS.mean())
    np.testing.assert_allclose(motion.acceleration, expected, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("Origin Time", "Time", "NS:1 does not begin with 'Origin Time'"),
        ("Mag.              5.7\n", "", "NS:6 does not begin with 'Station Code'"),
        ("\nMemo.             ", "", "NS:17 does not begin with 'Memo.'"),
        ("100Hz", "0Hz", r"Sampling Freq\(Hz\) at .*:11 must be above 0 and written as 100Hz"),
        ("100Hz", "hundred", "'hundred' at .*:11 is not a number"),
        ("100Hz", "", r"Sampling Freq\(Hz\) at .*:11"),
        ("3920(gal)/6170270", "3920/6170270", r"Scale Factor at .*:14 .*written as 3920\(gal\)/6170270"),
        ("3920(gal)/6170270", "3920(gal)/0", "Scale Factor at .*:14 must be above 0"),
        ("3920(gal)/6170270", "many(gal)/3", "'many' at .*:14 is not a number"),
        ("Duration Time(s)  2", "Duration Time(s)  3", "announces 3 s at 100 Hz, 300 values,.*holds 200"),
        ("Duration Time(s)  2", "Duration Time(s)  1", "announces 1 s at 100 Hz, 100 values,.*holds 200"),
        ("Duration Time(s)  2", "Duration Time(s)  x", "'x' at .*:12 is not a number"),
    ],
)
def test_a_wrong_header_line_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_knet(written(tmp_path, {old: new}))


@pytest.mark.parametrize(
    ("counts", "words"),
    [
        ("1 2 3\n4 a 6", "'a' at .*NS:19 is not a number"),
        ("1 2 nan", "NS:18 is nan, but must be finite"),
        ("", "holds 0: get the whole file"),
    ],
)
def test_a_wrong_value_is_named_with_its_line(tmp_path: Path, counts: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_knet(written(tmp_path, counts=counts))
