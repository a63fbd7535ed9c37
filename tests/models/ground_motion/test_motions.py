import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from common.errors import InputError
from models.ground_motion import MOTIONS, STANDARD_GRAVITY, load
from models.ground_motion.motions import FOLDER, READERS

PUBLISHED = {  # interval s, points, peak g as the sources print it, digits
    "el_centro_1940_ns": (0.02, 1560, 0.319, 3),
    "loma_prieta_1989_corralitos_000": (0.005, 7997, 0.6447, 4),
    "san_fernando_1971_pacoima_dam_164": (0.01, 4172, 1.2190, 4),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_shipped_records_have_their_published_values(name: str, tmp_path: Path) -> None:
    interval, points, peak, digits = PUBLISHED[name]
    motion = load(name, tmp_path)
    assert (motion.interval, motion.points) == (interval, points)
    assert round(motion.peak / STANDARD_GRAVITY, digits) == peak
    assert motion.acceleration.mean() == pytest.approx(0.0, abs=1e-3 * motion.peak)


def test_el_centro_is_the_version_with_1559_points_after_a_zero(tmp_path: Path) -> None:
    motion = load("el_centro_1940_ns", tmp_path)
    in_g = motion.acceleration / STANDARD_GRAVITY
    np.testing.assert_allclose(in_g[:5], [0.0, 0.0063, 0.00364, 0.00099, 0.00428], atol=1e-12)
    assert in_g.min() == pytest.approx(-0.31882)
    assert np.argmin(in_g) == 102
    assert motion.describe() == (
        "El Centro 1940 NS (1,559-point version after a zero at t = 0), dt 0.02 s, 1560 points, PGA 0.3188 g"
    )


def test_the_note_on_the_records_origin_and_the_registry_agree() -> None:
    note = (FOLDER / "ORIGIN.md").read_text(encoding="utf-8")
    data = {path.name for path in FOLDER.iterdir() if path.suffix != ".md"}
    assert data == {shipped.file for shipped in MOTIONS.values()}
    for name, shipped in MOTIONS.items():
        assert f"`{name}`" in note
        assert f"`{shipped.file}`" in note


def test_a_path_is_relative_to_the_folder_given_or_absolute(tmp_path: Path) -> None:
    path = tmp_path / "records" / "mine.csv"
    path.parent.mkdir()
    path.write_text("time (s),acceleration (m/s2)\n0,0\n0.01,1\n")
    relative = load("records/mine.csv", tmp_path)
    absolute = load(str(path), Path("elsewhere"))
    assert relative.describe() == absolute.describe()
    assert relative.peak == 1.0


AT2 = "title\nevent\nUNITS OF G\nNPTS= 2, DT= 0.02\n0.1 0.2\n"
CSV = "time (s),acceleration (g)\n0,0.1\n0.02,0.2\n"
KNET = [""] * 17
KNET[0], KNET[5], KNET[10] = "Origin Time 2000", "Station Code TCGH13", "Sampling Freq(Hz) 2Hz"
KNET[11:14] = ["Duration Time(s) 1", "Dir. 4", "Scale Factor 2000(gal)/8388608"]
KNET[16] = "Memo."
KNET_TEXT = "\n".join(KNET) + "\n1 3\n"


@pytest.mark.parametrize(
    ("file", "text", "name"),
    [
        ("a.AT2", AT2, "event"),
        ("a.at2", AT2, "event"),
        ("a.txt", AT2, "event"),
        ("a", AT2, "event"),
        ("a.csv", CSV, "a"),
        ("a.TXT", CSV, "a"),
        ("a.txt", KNET_TEXT, "TCGH13 N-S surface, 2000"),
        ("a.dat", KNET_TEXT, "TCGH13 N-S surface, 2000"),
        *(
            (f"a{s}", KNET_TEXT, "TCGH13 N-S surface, 2000")
            for s in (".NS", ".ew", ".UD", ".NS1", ".EW2", ".ud2")
        ),
    ],
)
def test_the_reader_is_chosen_by_suffix_or_content(tmp_path: Path, file: str, text: str, name: str) -> None:
    (tmp_path / file).write_text(text)
    assert load(file, tmp_path).name == name


@pytest.mark.parametrize("content", [b"", b"hello\n", bytes(range(256))])
def test_an_unknown_format_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.bin").write_bytes(content)
    with pytest.raises(
        InputError, match=r"a\.bin is unknown: give it the suffix of its format \(\.at2, \.csv"
    ):
        load("a.bin", tmp_path)


@pytest.mark.parametrize("suffix", [*READERS, ".txt"])
def test_a_message_about_wrong_contents_names_the_file(tmp_path: Path, suffix: str) -> None:
    for content in (b"", b"\n", b"a,b\n1,2\n", bytes(range(256))):
        (tmp_path / f"a{suffix}").write_bytes(content)
        with pytest.raises(InputError, match=re.escape(f"a{suffix}")):
            load(f"a{suffix}", tmp_path)


def test_a_missing_record_is_refused_with_the_shipped_ones_and_the_nearest_name(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load("elcentro_1940", tmp_path)
    message = str(caught.value)
    assert str(tmp_path / "elcentro_1940") in message
    assert all(name in message for name in MOTIONS)
    assert message.endswith("did you mean el_centro_1940_ns?")


def test_a_record_name_unlike_any_other_gets_no_suggestion(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"one of el_centro_1940_ns.*\.$"):
        load("zzz.at2", tmp_path)


LETTERS = st.text(alphabet='0123456789.,;\t -+eE#"()/\n²agcms_timeNPTSDORIGU\x00\x1b', max_size=200)


BEGINNINGS = (
    b"",
    b"time,acc\n0,1\n0.02,2\n",
    b"a\nb\nUNITS OF G\nNPTS= 2, DT= .01 SEC\n",
    b"1e308 1e308\n-1e308 1\n",
)
SHARED = settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture]
)  # an example writes its file anew


@settings(SHARED, max_examples=200, deadline=None, derandomize=True)
@given(
    st.one_of(LETTERS.map(str.encode), st.binary(max_size=200)),
    st.sampled_from(BEGINNINGS),
    st.sampled_from(["csv", "txt", "dat", "at2", "ns"]),
)
def test_any_file_is_read_or_refused_in_one_sentence(
    tmp_path: Path, content: bytes, begin: bytes, suffix: str
) -> None:
    (tmp_path / f"a.{suffix}").write_bytes(begin + content)
    try:
        motion = load(f"a.{suffix}", tmp_path, 0.01)
    except InputError as error:
        assert "\n" not in str(error)
        assert str(error).isprintable()
    else:
        assert np.all(np.isfinite(motion.acceleration))
        assert motion.interval >= 1e-6


def test_a_record_that_states_interval_and_unit_refuses_others(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="come every 0.02 s, and dt in .ground_motion. is 0.01 s"):
        load("el_centro_1940_ns", tmp_path, 0.01)
    with pytest.raises(InputError, match="says its unit itself: leave out unit"):
        load("san_fernando_1971_pacoima_dam_164", tmp_path, 0.0, "gal")
