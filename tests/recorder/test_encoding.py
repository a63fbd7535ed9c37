"""Rows that the kernel encodes, compared with protobuf's own messages and the MCAP library's own file."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from common.recording import chunks
from common.recording.chunks import MESSAGE
from common.recording.rows import HEAD, Item, RowPacker, is_plain
from common.recording.schema import message_class, message_name, schema_file
from common.recording.writer import CHUNK_SIZE, Recording
from common.signals import TOPICS, FieldType, Signal, default_topics
from recorder.encoding import RowEncoder

PLAIN = ("master", "slave", "latency")
CHANNELS = {topic: 255 + number for number, topic in enumerate(TOPICS)}
SEVERAL = default_topics(("slave.roof", "slave.cellar", "slave.attic"))
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


class Recorded:
    """Rows of some topics in a building of some storeys, as the kernel and as protobuf's own library have them."""

    def __init__(self, topics: Mapping[str, tuple[Signal, ...]], storeys: int) -> None:
        self.topics, self.storeys = topics, storeys
        self.plain = [topic for topic, rows in topics.items() if is_plain(rows)]
        self.channels = {topic: 255 + number for number, topic in enumerate(topics)}
        self.encoder = RowEncoder(topics, self.channels, storeys)
        self.packer = RowPacker(topics, storeys)
        self.classes = {
            topic: message_class(schema_file(topic, topics[topic], storeys), f"rths.{message_name(topic)}")
            for topic in self.plain
        }

    def drawn(self, draw: st.DrawFn) -> tuple[Item, bytes]:
        """An item, and its record as protobuf's own library and the MCAP format have it."""
        topic, log_ns, publish_ns = draw(st.sampled_from(self.plain)), draw(STAMP), draw(STAMP)
        values: dict[str, Any] = {}
        flat: list[Any] = []
        for row in self.topics[topic]:
            count = row.count(self.storeys)
            numbers = [draw(DRAWN[row.kind]) for _ in range(count)]
            values[row.name] = numbers if count > 1 else numbers[0]
            flat += numbers
        data: bytes = self.classes[topic](**values).SerializeToString()
        length = MESSAGE.size - chunks.PREFIX + len(data)
        head = MESSAGE.pack(5, length, self.channels[topic], values["seq"], log_ns, publish_ns)
        return self.packer.item(topic, log_ns, publish_ns, flat), head + data


SHAPES = {
    "one of each": Recorded(TOPICS, 1),
    "three storeys and slaves": Recorded(SEVERAL, 3),
    "two storeys": Recorded(TOPICS, 2),
}


@pytest.mark.parametrize("shape", SHAPES)
@given(st.data())
def test_encoded_rows_equal_those_of_protobufs_own_library(shape: str, data: st.DataObject) -> None:
    recorded = SHAPES[shape]
    drawn = data.draw(st.lists(st.composite(recorded.drawn)(), min_size=1, max_size=15))
    items, records = [item for item, _ in drawn], [record for _, record in drawn]
    block = recorded.encoder.encode(items)
    assert bytes(block.records) == b"".join(records)
    places = [sum(map(len, records[:place])) for place in range(len(items))]
    times = [HEAD.unpack_from(row)[0] for _, row in items]
    expected: dict[int, list[list[int]]] = {}
    for (topic, _), time, place in zip(items, times, places, strict=True):
        expected.setdefault(recorded.channels[topic], []).append([time, place])
    assert [(channel, entries.tolist()) for channel, entries in block.entries.items()] == [*expected.items()]
    assert (block.first, block.last) == (min(times), max(times))


def write(path: Path, *, rows: bool) -> None:
    """A file of several chunks, whose times do not grow."""
    recording = Recording(path, "trial", 1, TOPICS)
    encoder, packer = RowEncoder(TOPICS, recording.channels, 1), RowPacker(TOPICS, 1)
    for tick in range(2 * CHUNK_SIZE // 400):
        items: list[tuple[Any, ...]] = [
            (topic, (tick * 7919) % 1000, tick, tick, *(tick % 3 for _ in TOPICS[topic][1:]))
            for topic in PLAIN
        ]
        if rows:
            packed = [
                packer.item(topic, log_ns, publish_ns, values) for topic, log_ns, publish_ns, *values in items
            ]
            recording.add_block(encoder.encode(packed))
        else:
            for topic, log_ns, publish_ns, *values in items:
                recording.add(topic, log_ns, publish_ns, values)
        if tick % 50 == 0:
            recording.flush()
    recording.close({})


def test_a_file_of_encoded_rows_equals_the_mcap_librarys_to_the_byte(
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
    item = RowPacker(TOPICS, 1).item("slave", 1, 1, (1, 0.5, 1, *[0.5] * 10))
    count, size = 3 * CHUNK_SIZE // len(item[1]), len(item[1])
    for _ in range(count):
        recording.add_block(encoder.encode([item]))
    recording.close({})
    with (tmp_path / "a.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == count
    assert len(summary.chunk_indexes) > 2
    assert max(found.uncompressed_size for found in summary.chunk_indexes) <= CHUNK_SIZE + size + MESSAGE.size


def test_topics_with_texts_or_tables_are_not_encoded_as_rows_of_numbers() -> None:
    assert [topic for topic, rows in TOPICS.items() if is_plain(rows)] == list(PLAIN)


def test_a_row_with_a_number_that_its_field_cannot_hold_is_refused() -> None:
    with pytest.raises(struct.error):
        RowPacker(TOPICS, 1).item("slave", 0, 0, (2**32, 0.0, -1, *[0.0] * 10))


def test_peaks_are_the_largest_magnitudes_of_all_rows() -> None:
    encoder, packer = RowEncoder(TOPICS, CHANNELS, 2), RowPacker(TOPICS, 2)
    names = [row.name for row in TOPICS["master"] for _ in range(row.count(2))]
    rows = [
        {"displacement": (0.5, -0.2), "column_force": float("nan")},
        {"displacement": (0.1, -2.0), "column_force": -3.0},
        {"displacement": (2.0, 0.0), "column_force": 2.0},
    ]
    for tick, row in enumerate(rows):
        given: dict[str, Any] = {"seq": tick} | row
        values = [given.get(name, 0) for name in dict.fromkeys(names)]
        flat = []
        for name, value in zip(dict.fromkeys(names), values, strict=True):
            flat += list(value) if isinstance(value, tuple) else [value] * names.count(name)
        encoder.encode([packer.item("master", tick, tick, flat)])
    found = encoder.peaks("master")
    assert found["displacement"] == (2.0, 1)
    assert found["column_force"] == (3.0, 1)
    assert found["velocity"] == (0.0, 0)
