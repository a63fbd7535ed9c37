"""The records of a recording's file one by one: where each ends, what it holds, and what a chunk unpacks to.

All code that opens a recording takes its records from here: `reader` reads the file from its beginning up to damage,
and `salvage` also searches for undamaged records behind damage.
"""

from __future__ import annotations

import io
import struct
import threading
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk, McapRecord
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC

RECORD_LIMIT = (
    64 << 20
)  # bytes of the largest record that is read: a thousand chunks as this software writes them
DAMAGE = (
    McapError,
    ValueError,
    struct.error,
    zstandard.ZstdError,
    MemoryError,
)  # raised by the libraries on damage
HEAD = struct.Struct("<BQ")  # opcode and length of a record
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
CHUNK = bytes([Opcode.CHUNK])
FOOTER_SIZE = HEAD.size + 20 + len(MCAP0_MAGIC)


class Unpacking(threading.local):
    """The unpacker of each thread: threads cannot share one, and making it for each chunk takes a fifth of the time."""

    def __init__(self) -> None:
        self.zstd = zstandard.ZstdDecompressor()


UNPACKING = Unpacking()


class GrowingFile:
    """A file that may be growing, read in pieces; `size` is its length when the object was made."""

    def __init__(self, stream: io.BufferedReader) -> None:
        self._stream = stream
        self.size = stream.seek(0, io.SEEK_END)

    def at(self, offset: int, length: int) -> bytes:
        """`length` bytes from an offset on, fewer at the end of the file."""
        self._stream.seek(offset)
        return self._stream.read(length)


def framed(source: GrowingFile, offset: int, end: int) -> tuple[int, int] | None:
    """Opcode and end of the record at an offset; None where it does not end before `end`.

    Raises:
        ValueError: the record is larger than `RECORD_LIMIT`.
    """
    head = source.at(offset, HEAD.size)
    if len(head) < HEAD.size:
        return None
    opcode, length = HEAD.unpack(head)
    if length > RECORD_LIMIT:
        raise ValueError("a record is larger than any of a recording")
    after = offset + HEAD.size + length
    return (opcode, after) if after <= end else None


def parsed(record: bytes) -> Any:
    """The MCAP library's object for the bytes of a record, with its opcode and length; a chunk stays packed."""
    if (
        record[:1] == CHUNK and len(record) >= HEAD.size
    ):  # nearly all bytes of a file: without the library's loop
        return Chunk.read(ReadDataStream(io.BytesIO(record[HEAD.size :])))
    stream = io.BytesIO(record + MCAP0_MAGIC)  # which follows a footer
    return next(StreamReader(stream, skip_magic=True, emit_chunks=True).records)


def written(record: McapRecord) -> bytes:
    """The bytes of a record, with its opcode and length."""
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def as_written(record: bytes) -> Any:
    """The record of these bytes, if writing it again gives the same bytes; raises ValueError where it does not."""
    found = parsed(record)
    if written(found) != record:
        raise ValueError("not as written")
    return found


def content(chunk: Chunk) -> bytes:
    """The unpacked records of a chunk, which may be compressed in any way that MCAP defines.

    Raises:
        ValueError: size or checksum are not those stated, or the content is larger than `RECORD_LIMIT`.
    """
    size = zstandard.frame_content_size(chunk.data) if chunk.compression == "zstd" else 0
    if max(size, chunk.uncompressed_size) > RECORD_LIMIT:
        raise ValueError("a chunk is larger than any of a recording")
    match chunk.compression:
        case "":
            data = chunk.data
        case "zstd":
            data = UNPACKING.zstd.decompress(chunk.data, chunk.uncompressed_size)
        case "lz4":  # which other programs write
            data = _lz4(chunk)
        case _:
            raise ValueError(f"a chunk is packed by '{chunk.compression}', which is not known here")
    if len(data) != chunk.uncompressed_size:
        raise ValueError("a chunk does not have its size")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("a chunk does not have its checksum")
    return data


def _lz4(chunk: Chunk) -> bytes:
    """A chunk unpacked by LZ4, at most as large as it says itself."""
    from lz4.frame import LZ4FrameDecompressor

    try:
        return bytes(LZ4FrameDecompressor().decompress(chunk.data, max_length=chunk.uncompressed_size))
    except RuntimeError as error:  # raised by the library on damage
        raise ValueError(str(error)) from None


def inner(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Opcode and whole bytes of every record in the content of a chunk."""
    place = 0
    while place < len(data):
        opcode, length = HEAD.unpack_from(data, place)
        begin, place = place, place + HEAD.size + length
        yield opcode, data[begin:place]


class RecordingSummary(NamedTuple):
    """The summary section of a finished recording: its offset in the file, and its records."""

    start: int
    records: list[Any]


def summary(source: GrowingFile) -> RecordingSummary | None:
    """The summary of a finished recording; None where there is none or its checksum is wrong."""
    tail = source.at(max(source.size - FOOTER_SIZE, 0), FOOTER_SIZE)
    if len(tail) < FOOTER_SIZE or not tail.endswith(MCAP0_MAGIC) or tail[0] != Opcode.FOOTER:
        return None
    start, _, crc = struct.unpack_from("<QQI", tail, HEAD.size)
    limit = source.size - FOOTER_SIZE
    if not len(MCAP0_MAGIC) <= start <= limit or limit - start > RECORD_LIMIT:
        return None
    data = source.at(start, limit - start)
    if zlib.crc32(tail[: HEAD.size + 16], zlib.crc32(data)) != crc:
        return None
    return RecordingSummary(start, [as_written(record) for _, record in inner(data)])
