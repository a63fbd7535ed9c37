"""Writes recordings, damages them, and lists what each intact chunk holds."""

from __future__ import annotations

import random
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk

from common.recording.records import HEAD
from common.recording.writer import Recording
from common.signals import TICK_TOPICS, TOPICS, FieldType

TICKS = 600
RAMPS = ("master_ramp", "slave_ramp")
PER_FLUSH = 25
Key = tuple[int, int, int, int, bytes]
Spot = tuple[str, int, int, Any]  # kind of a record, its place, its end, the record

TIMES = slice(HEAD.size, HEAD.size + 16)  # of a chunk's first and last message, which no checksum covers
DEFAULTS: dict[FieldType, Any] = {
    FieldType.FLAG: False,
    FieldType.INDEX: 3,
    FieldType.STAMP: 2**44,
    FieldType.TEXT: "ramping",
}


def values(topic: str, seq: int, noise: random.Random) -> list[Any]:
    """The values of a message; each file has its own random generator, so it does not depend on other tests."""
    return [seq, *(DEFAULTS.get(row.kind, noise.random()) for row in TOPICS[topic][1:])]


def garbage(size: int) -> bytes:
    return random.Random(1).randbytes(size)


def write(path: Path, ticks: int = TICKS, *, close: bool = True, skip: range = range(0)) -> None:
    recording, noise = Recording(path, "trial", 1, TOPICS), random.Random(1)
    recording.metadata("plan", {"toml": "x = 1"})
    recording.attach("ground_motion", bytes(range(256)) * 8, "application/octet-stream")
    recording.add("event", 0, 0, (0.0, "recorder", "info", "begin", "begun", {}))
    recording.flush()
    for seq in range(ticks):
        for topic in TICK_TOPICS:
            if seq not in skip:
                recording.add(topic, seq * 2_000_000, seq * 2_000_000 + 5, values(topic, seq, noise))
        if seq % PER_FLUSH == PER_FLUSH - 1:
            recording.flush()
    if close:
        recording.close({"outcome": "completed"})
    else:
        recording.flush()
        recording.abandon()


def records_outside_chunks(path: Path) -> list[Spot]:
    """Every record outside chunks: its type, its first byte, the byte after it, and the record."""
    found: list[Spot] = []
    with path.open("rb") as stream:
        records = StreamReader(stream, emit_chunks=True).records
        begin = 8
        while True:
            try:
                record = next(records)
            except Exception:
                return found
            found.append((type(record).__name__, begin, stream.tell(), record))
            begin = stream.tell()


@cache
def chunks_of(path: Path) -> list[tuple[bytes, set[Key]]]:
    """The bytes and the messages of every chunk of an undamaged file."""
    data = path.read_bytes()
    return [
        (data[spot[1] : spot[2]], set(keys(spot[3])))
        for spot in records_outside_chunks(path)
        if spot[0] == "Chunk"
    ]


def contains_chunk(data: bytes, chunk: bytes) -> bool:
    """Whether the data contain a chunk as it was written; its times are not compared."""
    place = data.find(chunk[TIMES.stop :]) - TIMES.stop
    return place >= 0 and data[place : place + TIMES.start] == chunk[: TIMES.start]


def keys(chunk: Chunk) -> list[Key]:
    return [key(record) for record in breakup_chunk(chunk) if isinstance(record, Message)]


def key(message: Message) -> Key:
    return (
        message.channel_id,
        message.sequence,
        message.log_time,
        message.publish_time,
        message.data,
    )


def read_by_the_library(path: Path) -> list[Key]:
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        found = [key(message) for _, _, message in reader.iter_messages(log_time_order=False)]
        assert summary.statistics.message_count == len(found)
        return found


def damaged(path: Path, tmp_path: Path, change: Callable[[bytearray], Any]) -> tuple[Path, Path]:
    data = bytearray(path.read_bytes())
    change(data)
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(data)
    return broken, tmp_path / "out.mcap"
