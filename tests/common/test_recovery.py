"""Recovery of recordings that were cut, whose bits were flipped, or whose bytes were overwritten, added or removed."""

from __future__ import annotations

import itertools
import json
import random
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from common.errors import InputError, RthsError
from common.recording.reader import read
from common.recording.records import HEAD
from common.recording.recover.recovery import recover
from common.recording.writer import REPEAT_BYTES, Recording
from common.signals import TICK_TOPICS, TOPICS
from rths.examine.recover import write_account
from tests.common.damaged import (
    PER_FLUSH,
    TICKS,
    TIMES,
    Key,
    chunks_of,
    contains_chunk,
    damaged,
    garbage,
    keys,
    read_by_the_library,
    records_outside_chunks,
    values,
    write,
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "a.mcap"
    write(path)
    return path


@pytest.fixture(scope="module")
def unfinished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("unfinished") / "a.mcap"
    write(path, close=False)
    return path


def test_an_undamaged_recording_is_the_same_after_recovery(whole: Path, tmp_path: Path) -> None:
    before = whole.read_bytes()
    found = recover(whole, tmp_path / "out.mcap")
    assert found.complete
    assert found.holes == []
    assert whole.read_bytes() == before
    assert read_by_the_library(tmp_path / "out.mcap") == read_by_the_library(whole)
    one, other = read(whole), read(tmp_path / "out.mcap")
    assert other.finished
    assert not other.damage
    recovery = other.metadata.pop("recovery")
    assert recovery == {"file": "a.mcap", "complete": "true", "bytes_lost": "0", "chunks_lost": "0"}
    assert (other.metadata, other.attachments, other.units) == (one.metadata, one.attachments, one.units)
    again = recover(tmp_path / "out.mcap", tmp_path / "again.mcap")
    assert again.complete


def test_a_cut_off_recording_loses_nothing_that_was_flushed(unfinished: Path, tmp_path: Path) -> None:
    found = recover(unfinished, tmp_path / "out.mcap")
    assert found.complete
    assert not found.finished
    run = read(tmp_path / "out.mcap")
    assert run.finished
    assert all(run.sequences[topic].tolist() == list(range(TICKS)) for topic in TICK_TOPICS)


@pytest.mark.parametrize("place", [0.02, 0.4, 0.97])
def test_a_flipped_bit_costs_one_chunk_and_its_content_is_named(
    unfinished: Path, tmp_path: Path, place: float
) -> None:
    chunks = [spot for spot in records_outside_chunks(unfinished) if spot[0] == "Chunk"][1:]
    _, begin, end, chunk = chunks[int(place * len(chunks))]
    broken, output = damaged(unfinished, tmp_path, lambda data: data.__setitem__(end - 7, data[end - 7] ^ 16))
    found = recover(broken, output)
    assert not found.complete
    assert [(hole.offset, hole.end, hole.chunks) for hole in found.holes] == [(begin, end, 1)]
    assert found.chunks_lost == 1
    gone = [message[1] for message in keys(chunk)]
    for topic in TICK_TOPICS:
        account = found.topics[topic]
        if end < chunks[-1][1]:
            (hole,) = account.missing
            assert (hole.first, hole.last) == (min(gone), max(gone))
            assert hole.after_ns == (min(gone) - 1) * 2_000_000 or min(gone) == 0
            assert hole.before_ns == (max(gone) + 1) * 2_000_000
        assert account.kept == TICKS - PER_FLUSH


def test_losses_at_the_end_are_known_from_the_summary(whole: Path, tmp_path: Path) -> None:
    _, _, end, chunk = [spot for spot in records_outside_chunks(whole) if spot[0] == "Chunk"][-1]
    broken, output = damaged(whole, tmp_path, lambda data: data.__setitem__(end - 7, data[end - 7] ^ 16))
    found = recover(broken, output)
    gone = sorted({message[1] for message in keys(chunk)})
    (hole,) = found.topics["slave"].missing
    assert (hole.first, hole.last, hole.before_ns) == (gone[0], gone[-1], None)
    assert found.chunks_lost == 1


@pytest.mark.parametrize("finished", [True, False])
@pytest.mark.parametrize("kind", ["noise", "zeros"])
def test_a_recording_without_its_beginning_is_read_with_the_copies_of_its_schemas(
    tmp_path: Path, finished: bool, kind: str
) -> None:
    path = tmp_path / "long.mcap"
    write(path, 3000, close=finished)
    assert path.stat().st_size > REPEAT_BYTES
    filling = bytes(60_000) if kind == "zeros" else garbage(60_000)
    broken, output = damaged(path, tmp_path, lambda data: data.__setitem__(slice(0, 60_000), filling))
    with pytest.raises(InputError, match="`rths recover` saves the undamaged part"):
        read(broken)
    found = recover(broken, output)
    run = read(output)
    first = int(run.sequences["master"][0])
    assert 0 < first < 300
    assert run.sequences["master"].tolist() == list(range(first, 3000))
    assert found.topics["master"].missing[0][:2] == (0, first - 1)
    assert found.topics["master"].missing[0].before_ns == first * 2_000_000
    assert found.origin_ns == 0


def test_a_chunk_with_damaged_times_is_recovered_completely(unfinished: Path, tmp_path: Path) -> None:
    _, begin, _, _ = [spot for spot in records_outside_chunks(unfinished) if spot[0] == "Chunk"][11]
    times = slice(begin + TIMES.start, begin + TIMES.stop)
    broken, output = damaged(unfinished, tmp_path, lambda data: data.__setitem__(times, garbage(16)))
    assert recover(broken, output).complete
    found = read_by_the_library(output)
    assert sorted(found) == sorted(key for _, messages in chunks_of(unfinished) for key in messages)


@pytest.mark.parametrize("kind", ["MessageIndex", "Channel"])
@pytest.mark.parametrize("gone", [1, 8, 16, 70])
def test_a_record_that_lost_bytes_does_not_cost_the_following_chunk(
    tmp_path: Path, kind: str, gone: int
) -> None:
    path, noise = tmp_path / "a.mcap", random.Random(1)
    recording = Recording(path, "trial", 1, TOPICS)
    for seq in range(2 * PER_FLUSH):
        recording.add("master", seq * 2_000_000, 0, values("master", seq, noise))
        if seq % PER_FLUSH == PER_FLUSH - 1:
            recording.flush()
    recording.abandon()
    records = records_outside_chunks(path)
    _, _, end, _ = next(
        one for one, behind in itertools.pairwise(records) if (one[0], behind[0]) == (kind, "Chunk")
    )
    broken, output = damaged(path, tmp_path, lambda data: data.__delitem__(slice(end - gone, end)))
    found = recover(broken, output)
    assert found.topics["master"].kept == 2 * PER_FLUSH
    assert found.complete == (kind == "MessageIndex")


def test_an_event_lost_after_a_lost_index_is_counted(tmp_path: Path) -> None:
    """A chunk may be smaller than the lost index before it and then stand in its place."""
    path, noise = tmp_path / "events.mcap", random.Random(1)
    recording = Recording(path, "trial", 1, TOPICS)
    for seq in range(2 * PER_FLUSH):
        recording.add("master", seq * 2_000_000, 0, values("master", seq, noise))
    recording.flush()
    recording.add("event", 0, 0, (0.0, "recorder", "info", "begin", "begun", {}))
    recording.flush()
    recording.add("master", 2 * PER_FLUSH * 2_000_000, 0, values("master", 2 * PER_FLUSH, noise))
    recording.flush()
    recording.abandon()
    (_, _, index, _), (_, begin, end, _) = [
        spot for spot in records_outside_chunks(path) if spot[0] == "Chunk"
    ][:2]
    assert end < begin + (begin - index)

    def change(data: bytearray) -> None:
        data[end - 3] ^= 1
        del data[index:begin]

    found = recover(*damaged(path, tmp_path, change))
    assert not found.complete
    assert found.chunks_lost == 1


def test_a_flipped_bit_in_the_first_chunk_leaves_the_rest_readable(unfinished: Path, tmp_path: Path) -> None:
    _, _, end, _ = next(spot for spot in records_outside_chunks(unfinished) if spot[0] == "Chunk")
    broken, output = damaged(unfinished, tmp_path, lambda data: data.__setitem__(end - 7, data[end - 7] ^ 1))
    assert read(unfinished).ticks("master") == TICKS
    found = recover(broken, output)
    assert found.topics["master"].lost == 0
    assert found.topics["event"].kept == 0
    assert read(output).ticks("master") == TICKS


def test_a_definition_with_a_checksum_is_preferred_to_one_without(whole: Path, tmp_path: Path) -> None:
    data = whole.read_bytes()
    place = data.index(b"rths/trial/master")
    broken, output = damaged(whole, tmp_path, lambda data: data.__setitem__(place + 12, ord("M")))
    assert recover(broken, output).complete
    assert set(read(output).columns) == set(TICK_TOPICS) == set(read(broken).columns)


def test_damaged_metadata_and_attachments_are_named_and_not_used(
    whole: Path, tmp_path: Path, capsys: Any
) -> None:
    data = whole.read_bytes()
    toml, ground = data.index(b"x = 1"), data.index(bytes(range(256)))

    def change(data: bytearray) -> None:
        data[toml + 4] = ord("2")
        data[ground + 9] ^= 1

    broken, output = damaged(whole, tmp_path, change)
    assert read(broken).damage == "in its metadata 'plan'"
    found = recover(broken, output)
    assert found.parts == ["metadata 'plan' (damaged)", "attachment 'ground_motion'"]
    run = read(output)
    assert "plan" not in run.metadata
    assert run.metadata["plan (damaged)"] == {"toml": "x = 2"}
    assert run.ticks("master") == TICKS
    write_account(found, sys.stdout)
    assert "lost: metadata 'plan' (damaged)\n" in capsys.readouterr().out


def test_lost_metadata_are_named(whole: Path, tmp_path: Path) -> None:
    kind, begin, _, record = next(spot for spot in records_outside_chunks(whole) if spot[0] == "Metadata")
    assert (kind, record.name) == ("Metadata", "plan")
    broken, output = damaged(whole, tmp_path, lambda data: data.__setitem__(begin, 0x7F))
    found = recover(broken, output)
    assert found.parts == ["metadata 'plan'"]
    assert not found.complete


def test_a_damaged_index_costs_no_data(whole: Path, tmp_path: Path) -> None:
    indices = [spot for spot in records_outside_chunks(whole) if spot[0] == "MessageIndex"]
    summary = next(spot for spot in records_outside_chunks(whole) if spot[0] == "Statistics")

    def change(data: bytearray) -> None:
        data[indices[10][1] + 5] ^= 64  # the length of one
        data[summary[1] + 20] ^= 1

    broken, output = damaged(whole, tmp_path, change)
    found = recover(broken, output)
    assert found.holes
    assert found.complete
    assert found.bytes_lost == 0
    assert read_by_the_library(output) == read_by_the_library(whole)


def test_ticks_that_were_never_recorded_do_not_count_as_lost(tmp_path: Path) -> None:
    path = tmp_path / "gap.mcap"
    write(path, skip=range(110, 115))
    found = recover(path, tmp_path / "out.mcap")
    assert found.complete
    assert found.topics["master"].unrecorded == 5


def test_inserted_garbage_of_any_length_costs_only_the_chunk_that_it_hits(
    whole: Path, tmp_path: Path
) -> None:
    chunks = [spot for spot in records_outside_chunks(whole) if spot[0] == "Chunk"]
    _, begin, end, _ = chunks[5]
    middle = (begin + end) // 2
    broken, output = damaged(
        whole, tmp_path, lambda data: data.__setitem__(slice(middle, middle), garbage(12_345))
    )
    found = recover(broken, output)
    assert found.chunks == len(chunks) - 1
    assert found.chunks_lost == 1
    broken, output = damaged(whole, tmp_path, lambda data: data.__delitem__(slice(middle, middle + 777)))
    output.unlink()
    assert recover(broken, output).chunks == len(chunks) - 1


def test_recovery_never_overwrites_its_input_or_an_existing_file(whole: Path, tmp_path: Path) -> None:
    before = whole.read_bytes()
    link = tmp_path / "link.mcap"
    link.hardlink_to(whole)
    for output in (whole, link):
        with pytest.raises(InputError, match="Cannot write .* the command reads it"):
            recover(whole, output)
    assert whole.read_bytes() == before
    with pytest.raises(InputError, match="There is no folder"):
        recover(whole, tmp_path / "no" / "out.mcap")


@pytest.mark.parametrize("data", [b"", b"\x89MCAP0\r\n", b"hello " * 1000, bytes(3_000_000)])
def test_a_file_without_recoverable_data_is_reported(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "a.mcap").write_bytes(data)
    with pytest.raises(InputError, match="Nothing can be recovered"):
        recover(tmp_path / "a.mcap", tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()
    with pytest.raises(InputError, match="No such file"):
        recover(tmp_path / "missing.mcap", tmp_path / "out.mcap")


Change = tuple[str, float, int, int]
CHANGES = st.lists(
    st.tuples(
        st.sampled_from(["cut", "flip", "overwrite", "insert", "delete"]),
        st.floats(0.0, 1.0),
        st.integers(1, 5000),
        st.integers(0, 255),
    ),
    min_size=1,
    max_size=4,
)


def apply(data: bytearray, change: Change) -> None:
    kind, share, length, byte = change
    place = min(int(share * len(data)), len(data) - 1)
    match kind:
        case "cut":
            del data[place:]
        case "flip":
            data[place] ^= byte or 1
        case "overwrite":
            data[place : place + length] = bytes([byte]) * min(length, len(data) - place)
        case "insert":
            data[place:place] = random.Random(byte).randbytes(length)
        case "delete":
            del data[place : place + length]


# a failing example has at most four changes, and to look for a smaller one takes minutes
@settings(max_examples=60, phases=[Phase.explicit, Phase.generate])
@given(changes=CHANGES, finished=st.booleans())
def test_all_intact_chunks_are_recovered_whatever_happens_to_a_file(
    whole: Path, unfinished: Path, tmp_path_factory: Any, changes: list[Change], finished: bool
) -> None:
    tmp_path = tmp_path_factory.mktemp("damaged")
    original = whole if finished else unfinished

    def change(data: bytearray) -> None:
        for one in changes:
            if data:
                apply(data, one)

    broken, output = damaged(original, tmp_path, change)
    after = broken.read_bytes()
    everything: set[Key] = set().union(*(messages for _, messages in chunks_of(original)))
    expected: set[Key] = set().union(
        *(messages for chunk, messages in chunks_of(original) if contains_chunk(after, chunk))
    )
    try:
        found = recover(broken, output)
    except RthsError as error:
        assert "\n" not in str(error)
        assert not output.exists()
        assert describes_nothing(after) or not expected
        return
    assert broken.read_bytes() == after
    read(output)
    json.dumps(found.plain(), allow_nan=False)
    got = set(read_by_the_library(output))
    assert got <= everything
    assert found.undefined or expected <= got
    if found.complete:
        assert got == expected


def describes_nothing(data: bytes) -> bool:
    """Whether the data hold no intact copy of any schema."""
    return b"\nrths.Master" not in data


@pytest.mark.slow
def test_recovery_uses_far_less_memory_than_the_size_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "big.mcap"
    recording, noise = Recording(path, "trial", 1, TOPICS), random.Random(1)
    for seq in range(60_000):
        recording.add("master", seq * 2_000_000, 0, values("master", seq, noise))
        if seq % 500 == 0:
            recording.flush()
    recording.close({})
    tracemalloc.start()
    try:
        assert recover(path, tmp_path / "out.mcap").complete
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert path.stat().st_size > 8_000_000
    assert peak < 4_000_000


def test_the_position_of_a_record_is_that_of_its_opcode(whole: Path) -> None:
    data = whole.read_bytes()
    for kind, begin, end, _ in records_outside_chunks(whole):
        if kind == "Chunk":
            assert HEAD.unpack_from(data, begin) == (6, end - begin - HEAD.size)
