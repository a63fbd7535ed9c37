"""A recording that is followed while it grows gives the same data as the reader finds in the complete one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import InputError
from common.recording.reader import Tail, read
from common.recording.run import Run
from common.recording.writer import Recording
from common.signals import TOPICS
from tests.common.test_recording import example, write


def put_together(parts: list[Run], topic: str, name: str) -> Any:
    found = [part.columns[topic][name] for part in parts if part.has(topic)]
    return np.concatenate(found) if found else np.array([])


def same(parts: list[Run], whole: Run) -> None:
    for topic, columns in whole.columns.items():
        for name, column in columns.items():
            assert np.array_equal(put_together(parts, topic, name), column), (topic, name)
    assert [event for part in parts for event in part.events] == whole.events
    assert parts[-1].metadata == whole.metadata


def test_flushed_samples_are_read_at_the_next_look(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with Tail(path) as tail:
        assert not tail.look().columns
        recording = write(path, 0, close=False)
        parts = [tail.look()]
        for begin in range(0, 500, 25):
            for seq in range(begin, begin + 25):
                recording.add("master", seq, seq, example("master", seq))
                recording.add("slave", seq, seq, example("slave", seq))
            assert not tail.look().has("master")
            recording.flush()
            parts.append(tail.look())
            assert parts[-1].sequences["master"].tolist() == list(range(begin, begin + 25))
            assert parts[-1].metadata["plan"] == {"toml": "x"}
        assert not tail.finished
        recording.close({"outcome": "completed"})
        parts.append(tail.look())
        assert tail.finished
        assert not tail.damage
    same(parts, read(path))


class RecordedBytes(bytes):
    """The bytes of a recording, which hypothesis prints; it refuses to print many."""

    def __repr__(self) -> str:
        return f"RecordedBytes({len(self)} bytes)"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A finished recording in many chunks."""
    path = tmp_path_factory.mktemp("tail") / "whole.mcap"
    recording = Recording(path, "trial", 1, TOPICS)
    recording.metadata("plan", {"toml": "x"})
    recording.attach("data", b"123", "application/octet-stream")
    for seq in range(60):
        for topic in ("master", "slave", "latency"):
            recording.add(topic, seq, seq, example(topic, seq))
        if seq % 5 == 0:
            recording.add("event", seq, seq, example("event", seq))
            recording.flush()
    recording.close({"outcome": "completed"})
    return RecordedBytes(path.read_bytes())


def grown(path: Path, data: bytes, cuts: list[int], most: int) -> tuple[list[Run], Tail]:
    """The parts seen where the file has grown to each of the cuts, and then to its end."""
    parts = []
    with path.open("wb", buffering=0) as stream, Tail(path) as tail:
        for begin, end in zip([0, *cuts], [*cuts, len(data)], strict=True):
            stream.write(data[begin:end])
            parts.append(tail.look(most))
            while tail.behind:
                parts.append(tail.look(most))
    return parts, tail


def test_a_recording_that_grows_byte_by_byte_is_read_completely(recorded: bytes, tmp_path: Path) -> None:
    end = recorded.index(b"completed")  # of the summary, behind the last chunk
    cuts = sorted({*range(end - 3_000, end + 100), *range(len(recorded) - 300, len(recorded))})
    parts, tail = grown(tmp_path / "growing.mcap", recorded, cuts, 1 << 20)
    assert tail.finished
    assert sum(part.has("master") for part in parts) > 2
    (tmp_path / "whole.mcap").write_bytes(recorded)
    same(parts, read(tmp_path / "whole.mcap"))


@given(data=st.data(), most=st.integers(1, 20_000))
def test_a_recording_that_grows_and_is_read_in_any_pieces_is_read_completely(
    recorded: bytes, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject, most: int
) -> None:
    cuts = sorted(data.draw(st.lists(st.integers(0, len(recorded)), max_size=8)))
    folder = tmp_path_factory.mktemp("tail")
    (folder / "whole.mcap").write_bytes(recorded)
    parts, tail = grown(folder / "growing.mcap", recorded, cuts, most)
    assert tail.finished
    same(parts, read(folder / "whole.mcap"))


def test_one_look_reads_a_bounded_amount_and_reports_that_more_is_waiting(
    recorded: bytes, tmp_path: Path
) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(recorded)
    with Tail(path) as tail:
        first = tail.look(len(recorded) // 2)
        assert tail.behind
        assert 0 < first.ticks("master") < 60
        ticks = first.ticks("master")
        while tail.behind:
            ticks += tail.look(len(recorded) // 10).ticks("master")
    assert ticks == 60
    assert tail.finished


@given(place=st.floats(0.0, 1.0), flip=st.integers(1, 255))
def test_reading_ends_at_damage_and_keeps_the_samples_before_it(
    recorded: bytes, tmp_path_factory: pytest.TempPathFactory, place: float, flip: int
) -> None:
    path = tmp_path_factory.mktemp("tail") / "damaged.mcap"
    damaged = bytearray(recorded)
    damaged[int(place * (len(recorded) - 1))] ^= flip
    path.write_bytes(damaged)
    try:
        with Tail(path) as tail:
            part = tail.look()
            assert not tail.behind
            assert not tail.look().has("master")
    except InputError as error:
        assert "\n" not in str(error)
        return
    sequences = part.sequences["master"].tolist() if part.has("master") else []
    assert sequences == list(range(len(sequences)))


def test_a_damaged_chunk_is_named_by_its_position(recorded: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream, Tail(path) as tail:
        half = len(recorded) // 2
        stream.write(recorded[:half] + bytes(100) + recorded[half + 100 :])
        stream.flush()
        part = tail.look()
        assert part.damage.startswith("at byte ")
        assert 0 < part.ticks("master") < 60
        assert not tail.finished


def test_a_file_that_is_replaced_while_followed_is_reported(recorded: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(recorded[:20_000])
    with Tail(path) as tail:
        tail.look()
        path.write_bytes(recorded[:100])
        assert "begun anew" in tail.look().damage


@pytest.mark.parametrize("content", [b"no recording at all", b"\x89"])
def test_a_followed_file_that_is_not_a_recording_is_refused_in_one_sentence(
    content: bytes, tmp_path: Path
) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(content)
    with Tail(path) as tail:
        if len(content) < 8:
            assert not tail.look().columns  # it may become one
            return
        with pytest.raises(InputError, match="is not a readable MCAP recording"):
            tail.look()


def test_a_folder_is_refused_as_a_recording(tmp_path: Path) -> None:
    with Tail(tmp_path) as tail, pytest.raises(InputError, match="Cannot read the recording"):
        tail.look()
