"""Recordings made to exhaust memory are refused early, and real recordings stay far below the bounds."""

from __future__ import annotations

import struct
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import zstandard

from common.errors import InputError
from common.recording import bounds
from common.recording.bounds import FREE_RECORDS, RECORD_BYTES, UNPACKED
from common.recording.reader import Tail, read
from common.recording.records import HEAD, MESSAGE
from common.recording.recover.recovery import recover
from common.recording.writer import Recording
from common.signals import TOPICS, FieldType

MAGIC = b"\x89MCAP0\r\n"
EMPTY_MESSAGE = HEAD.pack(5, MESSAGE.size) + MESSAGE.pack(1, 0, 0, 0)
MEGABYTE = 1 << 20
FAT_MESSAGE = HEAD.pack(5, MEGABYTE) + bytes(MEGABYTE)
HURTING = {
    "twelve million empty messages": ([EMPTY_MESSAGE * 60_000] * 200, "holds more than"),
    "zeros": ([bytes(1 << 20)] * 10, "holds more than"),
    "one fat message after another": ([FAT_MESSAGE] * 1000, "unpacks to more than"),
}


def followed(path: Path) -> None:
    """Reads a growing file as `rths live` does."""
    with Tail(path) as tail:
        tail.look()


READERS: dict[str, Callable[[Path], Any]] = {
    "read": read,
    "recover": lambda path: recover(path, path.with_suffix(".out")),
    "live": followed,
}


def chunk(data: bytes) -> bytes:
    """A chunk record in the MCAP format."""
    packed = zstandard.compress(data)
    head = struct.pack("<QQQII", 0, 0, len(data), zlib.crc32(data), 4) + b"zstd"
    return HEAD.pack(6, len(head) + 8 + len(packed)) + head + struct.pack("<Q", len(packed)) + packed


@pytest.fixture(scope="module")
def files_that_exhaust_memory(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The files built to exhaust memory, by name; equal chunks are packed once."""
    folder, found = tmp_path_factory.mktemp("files_that_exhaust_memory"), {}
    for number, (name, (contents, _)) in enumerate(HURTING.items()):
        found[name] = folder / f"{number}.mcap"
        found[name].write_bytes(MAGIC + chunk(contents[0]) * len(contents))
    return found


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("name", HURTING)
def test_a_file_built_to_exhaust_memory_is_refused_early(
    name: str, reader: str, files_that_exhaust_memory: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        bounds, "FREE_BYTES", MEGABYTE
    )  # the same file as with larger messages, but sooner made
    path = files_that_exhaust_memory[name]
    before = time.process_time()
    with pytest.raises(InputError, match=HURTING[name][1]) as caught:
        READERS[reader](path)
    spent = time.process_time() - before
    assert str(caught.value).startswith(f"{path} is not read further: it ")
    assert spent < 5.0  # of this process alone; a minute without the bounds
    assert not path.with_suffix(".out").exists()


@pytest.mark.parametrize("storeys", [1, 1000])
def test_a_recording_of_a_building_at_rest_stays_far_below_the_bounds(storeys: int, tmp_path: Path) -> None:
    """Nothing packs better than what does not move: half of either bound is not reached, whatever the test's length."""
    path, ticks = tmp_path / "rest.mcap", 1500 if storeys == 1 else 200
    topics = {topic: TOPICS[topic] for topic in ("master", "slave", "latency")}
    recording = Recording(path, "rest", storeys, topics)
    for tick in range(ticks):
        for topic, rows in topics.items():
            values: dict[str, Any] = {"seq": tick, "t": tick * 0.002}
            rest = ([0.0] * storeys if row.kind is FieldType.STOREYS and storeys > 1 else 0 for row in rows)
            row = [values.get(row.name, value) for row, value in zip(rows, rest, strict=True)]
            recording.add(topic, tick * 2_000_000, tick * 2_000_000, row)
    recording.close({})
    size, content = path.stat().st_size, unpacked_size(path)
    assert content < UNPACKED * size
    assert 3 * ticks * RECORD_BYTES * 2 < size
    assert read(path).ticks("slave") == ticks


def unpacked_size(path: Path) -> int:
    """The number of bytes to which the chunks of a file unpack."""
    data, place, size = path.read_bytes(), len(MAGIC), 0
    while place < len(data) - len(MAGIC):
        opcode, length = HEAD.unpack_from(data, place)
        size += struct.unpack_from("<Q", data, place + HEAD.size + 16)[0] if opcode == 6 else 0
        place += HEAD.size + length
    return size


def test_the_ratio_bound_does_not_apply_to_a_short_file(tmp_path: Path) -> None:
    path = tmp_path / "short.mcap"
    path.write_bytes(MAGIC + chunk(EMPTY_MESSAGE * FREE_RECORDS))
    with pytest.raises(InputError, match="holds no topic"):
        read(path)


@pytest.mark.parametrize("packing", ["", "lz4"])
def test_files_packed_by_other_programs_are_read_and_recovered(packing: str, tmp_path: Path) -> None:
    from mcap.reader import make_reader
    from mcap.writer import CompressionType, Writer

    path, other = tmp_path / "a.mcap", tmp_path / "b.mcap"
    recording = Recording(path, "trial", 1, TOPICS)
    recording.add("event", 0, 0, (0.0, "master", "info", "begin", "begun", {}))
    recording.close({})
    with path.open("rb") as stream, other.open("wb") as sink:
        writer = Writer(sink, compression=CompressionType.LZ4 if packing else CompressionType.NONE)
        writer.start()
        for schema, channel, message in make_reader(stream).iter_messages():
            assert schema is not None
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            place = writer.register_channel(channel.topic, channel.message_encoding, number, channel.metadata)
            writer.add_message(place, message.log_time, message.data, message.publish_time, message.sequence)
        writer.finish()  # type: ignore[no-untyped-call]
    assert read(other).events == read(path).events
    assert recover(other, tmp_path / "out.mcap").complete
    assert read(tmp_path / "out.mcap").events == read(path).events
