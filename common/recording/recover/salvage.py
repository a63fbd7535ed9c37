"""Finds the whole records of a damaged recording: judges each by itself, and searches for the next one behind damage.

A chunk is whole if its checksum is right. Any other record is whole if reading and writing it again gives the same
bytes; those of an attachment include its checksum. A record without a checksum is not whole if a whole chunk begins
within it: then it has lost bytes and its length reaches into the chunk. After damage the search resumes only at records
that random bytes do not form by chance (`ANCHORS`).
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

from mcap.opcode import Opcode
from mcap.records import Chunk
from mcap.writer import MCAP0_MAGIC

from common.recording.records import (
    DAMAGE,
    HEAD,
    RECORD_LIMIT,
    GrowingFile,
    as_written,
    content,
    framed,
    inner,
)

WINDOW = 1 << 20  # bytes searched at a time: 1 MiB keeps the memory small and makes few calls
ANCHORS = (Opcode.CHUNK, Opcode.ATTACHMENT, Opcode.METADATA, Opcode.SCHEMA, Opcode.CHANNEL)
GUARDED = (Opcode.CHUNK, Opcode.ATTACHMENT)  # records with a checksum of their own
# An anchor's opcode and a little-endian length of at most `RECORD_LIMIT`; a look-ahead, because two matches may
# overlap.
ANCHOR = re.compile(b"(?=[" + re.escape(bytes(ANCHORS)) + rb"][\s\S]{3}[\x00-\x04]\x00{4})")
INDEX_HEAD, INDEX_ENTRY = HEAD.size + 6, 16  # bytes of a message index, and of each message in it


class WholeRecord(NamedTuple):
    """A whole record: its place in the file, the record (None for a message index), and a chunk's unpacked content."""

    offset: int
    end: int
    opcode: int
    record: Any
    content: bytes


class FileHole(NamedTuple):
    """Bytes that form no whole record, how many chunks begin in them, and whether content may be lost with them.

    The index of a chunk and the summary at the end are no loss, because they are made again. Where a chunk begins in a
    hole that is as short as an index, bytes of the index were cut out and the chunk stands in its place.
    """

    offset: int
    end: int
    chunks: int
    lossy: bool


def judge(source: GrowingFile, offset: int, end: int) -> WholeRecord | None:
    """The whole record at an offset, None where there is none before `end`."""
    record, data = None, b""
    try:
        frame = framed(source, offset, end)
        if frame is None or frame[0] == Opcode.MESSAGE:  # outside a chunk, where no checksum covers it
            return None
        opcode, after = frame
        if opcode == Opcode.MESSAGE_INDEX:
            check_index(source.at(offset, INDEX_HEAD))
        else:
            record = as_written(source.at(offset, after - offset))
        if isinstance(record, Chunk):
            data = content(record)
            if data and not record.uncompressed_crc:
                return None  # no checksum says that it is whole
    except DAMAGE:
        return None
    if opcode not in GUARDED and overruns(source, offset, after, end):
        return None
    return WholeRecord(offset, after, opcode, record, data)


def check_index(head: bytes) -> None:
    """Raise ValueError where the length of a message index does not fit the number of bytes of its entries."""
    _, length, _, counted = struct.unpack("<BQHI", head)
    if counted != length - 6 or counted % INDEX_ENTRY:
        raise ValueError("length of the index")


def overruns(source: GrowingFile, offset: int, after: int, end: int) -> bool:
    """Whether a whole chunk begins in a record without a checksum, which goes from `offset` to `after`."""
    # the bytes after the record belong to the head of a chunk that begins at the record's last byte
    data = source.at(offset, after - offset + HEAD.size - 1)
    places = (offset + found.start() for found in ANCHOR.finditer(data, HEAD.size))
    return any(chunk_end(source, place) and judge(source, place, end) for place in places)


def chunk_end(source: GrowingFile, offset: int) -> int:
    """The end of a chunk whose head is whole, whatever its content; 0 where no such head is at the offset."""
    head = source.at(offset, HEAD.size + 40)
    if len(head) < HEAD.size + 40:
        return 0
    opcode, length = HEAD.unpack_from(head)
    size, _, name = struct.unpack_from("<QII", head, HEAD.size + 16)
    rest = source.at(offset + HEAD.size + 32, name + 8) if name <= 4 else b""
    known = rest[:-8] in (b"", b"zstd", b"lz4")
    if opcode != Opcode.CHUNK or size > RECORD_LIMIT or not known or len(rest) < 8:
        return 0
    data = struct.unpack("<Q", rest[-8:])[0]
    return offset + HEAD.size + length if length == 40 + name + data else 0


def survey(source: GrowingFile, end: int) -> Iterator[WholeRecord | FileHole]:
    """Every whole record before `end`, and the holes between them, in order."""
    offset = len(MCAP0_MAGIC) if source.at(0, len(MCAP0_MAGIC)) == MCAP0_MAGIC else 0
    index_end, ended = 0, False
    while offset < end:
        found = judge(source, offset, end)
        if found is None:
            resumed, chunks = resume(source, offset, end)
            lossy = chunks > 0 or not (ended or resumed <= index_end)
            yield FileHole(offset, resumed, chunks, lossy)
            offset = resumed
            continue
        yield found
        offset = found.end
        ended = ended or found.opcode == Opcode.DATA_END
        if found.opcode == Opcode.CHUNK:
            index_end = found.end + index_size(found.content)


def index_size(data: bytes) -> int:
    """Bytes of the message indices that follow a chunk of this content."""
    channels = [record[HEAD.size :][:2] for opcode, record in inner(data) if opcode == Opcode.MESSAGE]
    return INDEX_HEAD * len(set(channels)) + INDEX_ENTRY * len(channels)


def resume(source: GrowingFile, offset: int, end: int) -> tuple[int, int]:
    """The offset of the next whole record behind damage at `offset`, and how many heads of chunks were passed."""
    chunks = 0
    while offset < end:
        after = chunk_end(source, offset)
        chunks += after > 0
        if offset < after < end and judge(source, after, end):
            return after, chunks
        offset = anchor(source, offset + 1, end)
        if offset < end and judge(source, offset, end):
            break
    return min(offset, end), chunks


def anchor(source: GrowingFile, offset: int, end: int) -> int:
    """The next offset before `end` at which the bytes match the beginning of an anchor, else `end`."""
    while offset < end:
        found = ANCHOR.search(source.at(offset, min(WINDOW, end - offset)))
        if found:
            return offset + found.start()
        offset += WINDOW - HEAD.size + 1
    return end
