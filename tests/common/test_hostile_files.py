"""Plans and recordings that another program wrote or a disk damaged are read or refused in one sentence."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import InputError, PlanError, RthsError
from common.plan.plan import Plan
from common.plan.read import parse
from common.recording.reader import read
from common.recording.records import RECORD_LIMIT
from common.recording.writer import Recording
from common.signals import TOPICS
from report.facts.summary import rejected

MAGIC = b"\x89MCAP0\r\n"
VALUES = [
    "nan",
    "inf",
    "-1",
    "[",
    "{}",
    "true",
    "1e400",
    "[[]]",
    "99999999999999999999",
    '"\\u0000"',
    "1979-05-27",
]


@pytest.mark.parametrize(
    "text", ["a=" + "[" * 100_000, "a=" + "{a=" * 100_000, "[structure]\nmass=" + "[" * 2_000]
)
def test_a_plan_with_extremely_deep_nesting_is_refused_in_one_sentence(text: str) -> None:
    with pytest.raises(PlanError, match="nested too deeply"):
        parse(text, Path())


@given(st.data())
def test_a_plan_with_any_values_is_read_or_refused_in_one_sentence(data: st.DataObject) -> None:
    lines = Plan().toml().split("\n")
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(0, len(lines) - 1))
        name, equals, _ = lines[place].partition("=")
        lines[place] = (
            f"{name}= {data.draw(st.sampled_from(VALUES))}" if equals else data.draw(st.text(max_size=9))
        )
    try:
        parse("\n".join(lines), Path()).digest()
    except RthsError as error:
        assert "\n" not in str(error)


def recorded(path: Path) -> bytes:
    """A recording of two events and three samples."""
    recording = Recording(path, "trial", 1, TOPICS)
    for check in (1.0, 3.0):
        recording.add("event", 0, 0, (0.0, "master", "warning", "rejected", "Frames.", {"check": check}))
    for seq in range(3):
        recording.add("slave", seq, seq, [seq, 0.0, -1, *[0.5] * 10])
    recording.close({})
    return path.read_bytes()


@settings(max_examples=100)
@given(changes=st.lists(st.tuples(st.floats(0.0, 1.0), st.integers(0, 255), st.integers(-9, 9)), max_size=6))
def test_a_damaged_recording_is_read_up_to_the_damage_or_refused(
    tmp_path_factory: pytest.TempPathFactory, changes: list[tuple[float, int, int]]
) -> None:
    path = tmp_path_factory.mktemp("damaged") / "a.mcap"
    content = bytearray(recorded(path))
    for share, value, length in changes:
        place = min(int(share * len(content)), len(content) - 1)
        content[place] = value
        if length < 0:
            del content[place : place - length]
        else:
            content[place:place] = bytes([value]) * length
    path.write_bytes(content)
    try:
        read(path)
    except InputError as error:
        assert str(path) in str(error)


@pytest.mark.parametrize("declared", [0, RECORD_LIMIT + 1])
def test_a_chunk_that_would_unpack_to_an_excessive_size_is_not_unpacked(
    declared: int, tmp_path: Path
) -> None:
    bomb = zstandard.compress(bytes(RECORD_LIMIT + 1))
    chunk = struct.pack("<QQQII", 0, 0, declared, 0, 4) + b"zstd" + struct.pack("<Q", len(bomb)) + bomb
    path = tmp_path / "bomb.mcap"
    path.write_bytes(MAGIC + b"\x06" + struct.pack("<Q", len(chunk)) + chunk)
    with pytest.raises(InputError, match="a chunk is larger"):
        read(path)


def test_a_summary_counts_what_was_rejected_once(tmp_path: Path) -> None:
    recorded(tmp_path / "a.mcap")
    assert rejected(read(tmp_path / "a.mcap")) == {"master": {"check": 3}}
