"""Rows that the kernel encodes, beside protobuf's own messages and the MCAP library's own file."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from common.recording import chunks
from common.recording.chunks import MESSAGE
from common.recording.schema import message_class, message_name, schema_file
from common.recording.writer import CHUNK_SIZE, Recording
from common.signals import TOPICS, FieldType
from recorder.encoding import RowEncoder, is_plain

PLAIN = ("master", "slave", "latency")
CHANNELS = {topic: 255 + number for number, topic in enumerate(TOPICS)}
ENCODER = RowEncoder(TOPICS, CHANNELS, 1)
CLASSES = {
    topic: message_class(schema_file(topic, TOPICS[topic], 1), f"rths.{message_name(topic)}")
    for topic in PLAIN
}
DOUBLES = st.one_of(st.floats(), st.sampled_from([0.0, -0.0, 5e-324]))
DRAWN: dict[FieldType, st.SearchStrategy[Any]] = {
    FieldType.NUMBER: DOUBLES,
    FieldType.STOREYS: DOUBLES,
    FieldType.COUNT: st.one_of(st.integers(0, 2**32 - 1), st.sampled_from([0, 127, 128, 2**31])),
    FieldType.INDEX: st.one_of(st.integers(-(2**31), 2**31 - 1), st.sampled_from([-1, 0, 1])),
    FieldType.STAMP: st.one_of(st.integers(-(2**63), 2**63 - 1), st.sampled_from([0, 2**56 - 1, 2**56, -1])),
    FieldType.FLAG: st.booleans(),
}
STAMP = st.integers(0, 2**63 - 1)
ITEM = st.sampled_from(PLAIN).flatmap(
    lambda topic: st.tuples(st.just(topic), STAMP, STAMP, *(DRAWN[row.kind] for row in TOPICS[topic]))
)


def record(item: tuple[Any, ...]) -> bytes:
    """An item as protobuf's own library and the MCAP format have it."""
    topic, log_ns, publish_ns, *values = item
    names = [row.name for row in TOPICS[topic]]
    data: bytes = CLASSES[topic](**dict(zip(names, values, strict=True))).SerializeToString()
    length = MESSAGE.size - chunks.PREFIX + len(data)
    return MESSAGE.pack(5, length, CHANNELS[topic], values[0], log_ns, publish_ns) + data


def row(item: tuple[Any, ...]) -> bytes:
    return ENCODER.layouts[item[0]].pack(*item[1:])


@given(st.lists(ITEM, min_size=1, max_size=40))
def test_rows_are_encoded_as_protobufs_own_library_does_it(items: list[tuple[Any, ...]]) -> None:
    block = ENCODER.encode([item[0] for item in items], [row(item) for item in items])
    records = [record(item) for item in items]
    assert bytes(block.records) == b"".join(records)
    assert block.channels == [CHANNELS[item[0]] for item in items]
    places = [sum(map(len, records[:place])) for place in range(len(items))]
    assert block.entries == [[item[1], place] for item, place in zip(items, places, strict=True)]


def write(path: Path, *, rows: bool) -> None:
    """A file of several chunks, whose times do not grow."""
    recording = Recording(path, "trial", 1, TOPICS)
    encoder = RowEncoder(TOPICS, recording.channels, 1)
    for tick in range(2 * CHUNK_SIZE // 400):
        items: list[tuple[Any, ...]] = [
            (topic, (tick * 7919) % 1000, tick, tick, *(tick % 3 for _ in TOPICS[topic][1:]))
            for topic in PLAIN
        ]
        if rows:
            packed = [encoder.layouts[topic].pack(*values) for topic, *values in items]
            recording.add_block(encoder.encode(PLAIN, packed))
        else:
            for topic, log_ns, publish_ns, *values in items:
                recording.add(topic, log_ns, publish_ns, values)
        if tick % 50 == 0:
            recording.flush()
    recording.close({})


def test_a_file_of_encoded_rows_is_the_librarys_own_to_the_byte(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path / "rows.mcap", rows=True)
    write(tmp_path / "messages.mcap", rows=False)
    monkeypatch.setattr(chunks, "BUILDER", "none")  # as of another version of the library
    write(tmp_path / "apart.mcap", rows=True)
    expected = (tmp_path / "messages.mcap").read_bytes()
    assert (tmp_path / "rows.mcap").read_bytes() == expected
    assert (tmp_path / "apart.mcap").read_bytes() == expected


def test_a_full_chunk_is_closed(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "a.mcap", "trial", 1, TOPICS)
    encoder = RowEncoder(TOPICS, recording.channels, 1)
    item = encoder.layouts["slave"].pack(1, 1, 1, 0.5, 1, *[0.5] * 10)
    for _ in range(3 * CHUNK_SIZE // len(item)):
        recording.add_block(encoder.encode(["slave"], [item]))
    recording.close({})
    with (tmp_path / "a.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == 3 * CHUNK_SIZE // len(item)
    assert len(summary.chunk_indexes) > 2
    assert (
        max(found.uncompressed_size for found in summary.chunk_indexes)
        <= CHUNK_SIZE + len(item) + MESSAGE.size
    )


def test_topics_of_texts_tables_and_several_values_are_no_rows_of_numbers() -> None:
    assert [topic for topic, rows in TOPICS.items() if is_plain(rows, 1)] == list(PLAIN)
    assert [topic for topic, rows in TOPICS.items() if is_plain(rows, 2)] == ["slave", "latency"]
    of_two = [row._replace(slaves=("slave.roof", "slave.cellar")) for row in TOPICS["slave"]]
    assert not is_plain(of_two, 1)


def test_a_number_that_its_field_cannot_hold_is_no_row() -> None:
    with pytest.raises(struct.error):
        ENCODER.layouts["slave"].pack(0, 0, 2**32, 0.0, -1, *[0.0] * 10)
