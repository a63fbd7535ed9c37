"""The share of the messages of damaged recordings that the MCAP library, `mcap recover` and `rths recover` recover.

`python -m benchmarks.damaged_files` prints a table; all read the same damaged file.
"""

from __future__ import annotations

import struct
import sys
import tempfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import zstandard
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk

from common.errors import InputError
from common.recording.reader import read
from common.recording.recover.recovery import recover
from common.recording.writer import Recording
from common.signals import TICK_TOPICS, TOPICS, FieldType

TICKS = 3000  # about 1.5 MB, so that the file repeats its schemas and channels once
PER_FLUSH = 25  # ticks: the recorder flushes every 50 ms, which are 25 ticks of 2 ms
SECTOR = 4096  # bytes: the sector of today's disks, which is readable or lost as a whole
LIMIT = 64 << 20  # bytes of a record: a thousand chunks; a larger length can only be a damaged one
LIBRARY = (McapError, ValueError, KeyError, struct.error, zstandard.ZstdError, MemoryError, OSError)
FILLING: dict[FieldType, Any] = {
    FieldType.FLAG: False,
    FieldType.INDEX: 3,
    FieldType.STAMP: 2**44,
    FieldType.TEXT: "ramping",
}

Change = Callable[[bytearray], None]


# -- the file and its damages -------------------------------------------------------------------------


def write(path: Path, ticks: int) -> None:
    """Write a finished recording of noise, which cannot be compressed, like the noise of sensors."""
    noise = np.random.default_rng(1)
    recording = Recording(path, "trial", 1, TOPICS)
    recording.metadata("plan", {"toml": "x = 1"})
    recording.attach("ground_motion", bytes(range(256)) * 8, "application/octet-stream")
    for seq in range(ticks):
        for topic in TICK_TOPICS:
            values = [seq, *(FILLING.get(row.kind, noise.random()) for row in TOPICS[topic][1:])]
            recording.add(topic, seq * 2_000_000, seq * 2_000_000, values)
        if seq % PER_FLUSH == PER_FLUSH - 1:
            recording.flush()
    recording.close({"outcome": "completed"})


def chunks(data: bytes | bytearray) -> list[tuple[int, int]]:
    """The positions (bytes) of the begin and end of every chunk of an undamaged file."""
    place, found = 8, []  # after the magic bytes
    while place < len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, place)
        if opcode == 6:  # of a chunk in the MCAP format
            found.append((place, place + 9 + length))
        place += 9 + length
    return found


def _third(data: bytearray) -> tuple[int, int]:
    places = chunks(data)
    return places[len(places) // 3]


def _cut(data: bytearray) -> None:
    del data[2 * len(data) // 3 :]


def _without_footer(data: bytearray) -> None:
    del data[-40:]


def _bit_in_a_chunk(data: bytearray) -> None:
    data[_third(data)[1] - 7] ^= 16


def _bit_in_a_length(data: bytearray) -> None:
    data[_third(data)[0] + 3] ^= 16


def _bit_in_the_index(data: bytearray) -> None:
    data[-2000] ^= 16


def _zeroed_sector(data: bytearray) -> None:
    begin = _third(data)[1] // SECTOR * SECTOR
    data[begin : begin + SECTOR] = bytes(SECTOR)


def _zeroed_sector_without_footer(data: bytearray) -> None:
    _zeroed_sector(data)
    _without_footer(data)


def _zeroed_begin(data: bytearray) -> None:
    data[: 16 * SECTOR] = bytes(16 * SECTOR)


def _bytes_gone(data: bytearray) -> None:
    del data[_third(data)[0] + 100 : _third(data)[0] + 877]


DAMAGES: dict[str, Change] = {
    "none": lambda _data: None,
    "cut off after two thirds": _cut,
    "footer missing": _without_footer,
    "a bit in a chunk": _bit_in_a_chunk,
    "a bit in a chunk's length": _bit_in_a_length,
    "a bit in the index at the end": _bit_in_the_index,
    "a sector of zeros": _zeroed_sector,
    "a sector of zeros, footer missing": _zeroed_sector_without_footer,
    "the first 64 kB zeros": _zeroed_begin,
    "777 bytes gone": _bytes_gone,
}


# -- ways to recover it -------------------------------------------------------------------------------


def in_order(path: Path) -> Iterator[Message]:
    """With the library's StreamReader, which checks the checksums, up to its first error."""
    known = set()
    with path.open("rb") as stream:
        for record in StreamReader(stream, validate_crcs=True, record_size_limit=LIMIT).records:
            if isinstance(record, Channel):
                known.add(record.id)
            elif isinstance(record, Message) and record.channel_id in known:
                yield record


def by_the_index(path: Path) -> Iterator[Message]:
    """With the library's `make_reader`, which uses the index at the end of the file, up to its first error."""
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        for _, _, message in reader.iter_messages(log_time_order=False):
            yield message


def as_mcap_recover(path: Path) -> Iterator[Message]:
    """As the command `mcap recover`: record after record by the lengths, skipping chunks with a wrong checksum."""
    with path.open("rb") as stream:
        for record in StreamReader(stream, emit_chunks=True, record_size_limit=LIMIT).records:
            if isinstance(record, Chunk) and whole(record):
                yield from (found for found in breakup_chunk(record) if isinstance(found, Message))


def whole(chunk: Chunk) -> bool:
    """Whether a chunk can be decompressed and has the right checksum."""
    try:
        return zlib.crc32(zstandard.decompress(chunk.data, chunk.uncompressed_size)) == chunk.uncompressed_crc
    except (zstandard.ZstdError, MemoryError):
        return False


def as_rths_recover(path: Path) -> Iterator[int]:
    """With `rths recover`, whose result is read again."""
    output = path.with_suffix(".recovered")
    try:
        recover(path, output, force=True)
    except InputError:
        return
    for numbers in read(output).sequences.values():
        yield from numbers


WAYS: dict[str, Callable[[Path], Iterator[Any]]] = {
    "library, in order": in_order,
    "library, by the index": by_the_index,
    "as `mcap recover`": as_mcap_recover,
    "`rths recover`": as_rths_recover,
}


def count(messages: Iterator[Any]) -> int:
    """The number of messages before an error or the end."""
    found = 0
    try:
        for _ in messages:
            found += 1
    except LIBRARY:
        pass
    return found


def compare(folder: Path, ticks: int = TICKS) -> dict[str, list[float]]:
    """The recovered share of the messages, by damage, in the order of `WAYS`."""
    original, damaged = folder / "whole.mcap", folder / "damaged.mcap"
    write(original, ticks)
    shares = {}
    for name, change in DAMAGES.items():
        data = bytearray(original.read_bytes())
        change(data)
        damaged.write_bytes(data)
        shares[name] = [count(way(damaged)) / (len(TICK_TOPICS) * ticks) for way in WAYS.values()]
    return shares


def main() -> None:
    """Print the table."""
    rows = [["damage", *WAYS], ["---"] * (1 + len(WAYS))]
    with tempfile.TemporaryDirectory() as folder:
        for name, shares in compare(Path(folder)).items():
            rows.append([name, *(f"{100.0 * share:.1f} %" for share in shares)])
    sys.stdout.writelines(f"| {' | '.join(row)} |\n" for row in rows)


if __name__ == "__main__":
    main()
