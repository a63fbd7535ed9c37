"""Finding what is whole in a damaged recording: every record judged by itself, resynchronised after damage.

A chunk is whole where its CRC is right. Any other record is whole where, read and written again, it gives the same
bytes; of an attachment these include its CRC. A record without a CRC is not whole where a whole chunk begins in it: it
lost bytes and runs on into the chunk. Behind damage only records count that noise does not give by chance.
"""

from __future__ import annotations

import io
import re
import struct
import zlib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

from common.recording.bounds import Bounds

# bytes of a record that is looked at: a thousand times the chunk that this software writes
RECORD_LIMIT = 64 << 20
DAMAGE = (McapError, ValueError, struct.error, zstandard.ZstdError, MemoryError)  # what libraries raise on it
HEAD = struct.Struct("<BQ")  # opcode and length of a record
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
WINDOW = 1 << 20  # bytes read at a time
KINDS: dict[int, Any] = {
    Opcode.HEADER: Header,
    Opcode.FOOTER: Footer,
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.CHUNK: Chunk,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.ATTACHMENT: Attachment,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex,
    Opcode.STATISTICS: Statistics,
    Opcode.METADATA: Metadata,
    Opcode.METADATA_INDEX: MetadataIndex,
    Opcode.SUMMARY_OFFSET: SummaryOffset,
    Opcode.DATA_END: DataEnd,
}
ANCHORS = (Opcode.CHUNK, Opcode.ATTACHMENT, Opcode.METADATA, Opcode.SCHEMA, Opcode.CHANNEL)
GUARDED = (Opcode.CHUNK, Opcode.ATTACHMENT)  # by a CRC of their own
# an anchor's opcode, and a length below the limit in little-endian order
ANCHOR = re.compile(b"[" + re.escape(bytes(ANCHORS)) + rb"][\s\S]{3}[\x00-\x04]\x00{4}")
FOOTER_SIZE = HEAD.size + 20 + len(MCAP0_MAGIC)
INDEX_HEAD, INDEX_ENTRY = HEAD.size + 6, 16  # bytes of a message index, and of each message in it


class Piece(NamedTuple):
    """A whole record: its place in the file, what it is, and its content, of a message index None."""

    offset: int
    end: int
    opcode: int
    record: Any


class Hole(NamedTuple):
    """Bytes that are no whole record, how many chunks began in them, and whether content may have been lost with them.

    Nothing is lost with the index of a chunk or with the summary at the end, which are made anew. Where a chunk
    begins in a hole that is as short as an index, the index is gone, and the chunk stands in its place.
    """

    offset: int
    end: int
    chunks: int
    lossy: bool


class Source:
    """A file read in pieces."""

    def __init__(self, stream: io.BufferedReader) -> None:
        self._stream = stream
        self.size = stream.seek(0, io.SEEK_END)
        self.bounds = Bounds(Path(stream.name), self.size)
        self._admitted: set[int] = set()  # places of chunks that were counted: each is judged several times

    def admit(self, offset: int, size: int) -> None:
        """Count the chunk at a place by its size unpacked; raises InputError where that is too much."""
        if offset not in self._admitted:
            self._admitted.add(offset)
            self.bounds.unpack(size)

    def at(self, offset: int, length: int) -> bytes:
        """Bytes from a place on, fewer at the end."""
        self._stream.seek(offset)
        return self._stream.read(length)

    def anchor(self, offset: int, end: int) -> int:
        """The next place before `end` that looks like the beginning of an anchor, else `end`."""
        while offset < end:
            found = ANCHOR.search(self.at(offset, min(WINDOW, end - offset)))
            if found:
                return offset + found.start()
            offset += max(WINDOW - HEAD.size + 1, 1)
        return end


def content(chunk: Chunk, admit: Callable[[int], None] | None = None) -> bytes:
    """The records of a chunk; `admit` is asked with their size before they are unpacked.

    Raises:
        ValueError: they are not those that were written, or cannot be had.
        InputError: `admit` does not admit so many bytes.
    """
    if chunk.uncompressed_size > RECORD_LIMIT or chunk.compression not in ("zstd", ""):
        raise ValueError("no chunk of a recording")
    data = chunk.data
    if chunk.compression:
        size = zstandard.get_frame_parameters(data).content_size
        if size not in (zstandard.CONTENTSIZE_UNKNOWN, chunk.uncompressed_size):
            raise ValueError("size of the content")
        if admit:
            admit(chunk.uncompressed_size)
        data = zstandard.decompress(data, chunk.uncompressed_size)
    if zlib.crc32(data) != chunk.uncompressed_crc or len(data) != chunk.uncompressed_size:
        raise ValueError("checksum of the content")
    return data


def inner(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Opcode and body of every record in the content of a chunk."""
    place = 0
    while place < len(data):
        opcode, length = HEAD.unpack_from(data, place)
        place += HEAD.size + length
        yield opcode, data[place - length : place]


def written(record: McapRecord) -> bytes:
    """A record as it stands in a file."""
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def parsed(opcode: int, body: bytes) -> Any:
    """The record of an opcode and a body; raises ValueError where it does not give the same bytes again."""
    record = KINDS[opcode].read(ReadDataStream(io.BytesIO(body)))
    if written(record)[HEAD.size :] != body:
        raise ValueError("not as written")
    return record


def judge(source: Source, offset: int, end: int) -> Piece | None:
    """The whole record at a place, None where there is none before `end`."""
    frame = framed(source, offset, end)
    if frame is None:
        return None
    opcode, length = frame
    after = offset + HEAD.size + length
    record = None
    try:
        if opcode == Opcode.MESSAGE_INDEX:
            check_index(length, source.at(offset + HEAD.size + 2, 4))
        else:
            record = parsed(opcode, source.at(offset + HEAD.size, length))
        if isinstance(record, Chunk):
            content(record, partial(source.admit, offset))
    except DAMAGE:
        return None
    if opcode not in GUARDED and overruns(source, offset, after, end):
        return None
    return Piece(offset, after, opcode, record)


def check_index(length: int, counted: bytes) -> None:
    """Raise ValueError where a message index is not as long as its entries, whose bytes it has counted."""
    if length < 6 or struct.unpack("<I", counted)[0] != length - 6 or (length - 6) % INDEX_ENTRY:
        raise ValueError("length of the index")


def overruns(source: Source, offset: int, after: int, end: int) -> bool:
    """Whether a whole chunk begins in a record without a CRC, which goes from `offset` to `after`."""
    data = source.at(
        offset, after - offset + HEAD.size - 1
    )  # with the head of a chunk that begins at its very end
    found = ANCHOR.search(data, HEAD.size)
    while found:
        place = offset + found.start()
        if chunk_end(source, place) and judge(source, place, end):
            return True
        found = ANCHOR.search(data, found.start() + 1)
    return False


def framed(source: Source, offset: int, end: int) -> tuple[int, int] | None:
    """Opcode and length of what may be a record at a place and ends before `end`."""
    head = source.at(offset, HEAD.size)
    if len(head) < HEAD.size:
        return None
    opcode, length = HEAD.unpack(head)
    known = opcode in KINDS or opcode == Opcode.MESSAGE_INDEX
    return (opcode, length) if known and length <= min(RECORD_LIMIT, end - offset - HEAD.size) else None


def chunk_end(source: Source, offset: int) -> int:
    """The end of a chunk with a whole head, whatever its content and what follows it; 0 if there is none."""
    head = source.at(offset, HEAD.size + 40)
    if len(head) < HEAD.size + 40:
        return 0
    opcode, length = HEAD.unpack_from(head)
    size, _, name = struct.unpack_from("<QII", head, HEAD.size + 16)
    rest = source.at(offset + HEAD.size + 32, name + 8) if name <= 4 else b""
    if opcode != Opcode.CHUNK or size > RECORD_LIMIT or rest[:-8] not in (b"", b"zstd") or len(rest) < 8:
        return 0
    data = struct.unpack("<Q", rest[-8:])[0]
    return offset + HEAD.size + length if length == 40 + name + data else 0


def pieces(source: Source, end: int) -> Iterator[Piece | Hole]:
    """Every whole record before `end`, and the holes between them, in order."""
    offset = len(MCAP0_MAGIC) if source.at(0, len(MCAP0_MAGIC)) == MCAP0_MAGIC else 0
    index_end, ended = 0, False
    while offset < end:
        piece = judge(source, offset, end)
        if piece is None:
            resumed, chunks = resume(source, offset, end)
            lossy = chunks > 0 or not (ended or resumed <= index_end)
            yield Hole(offset, resumed, chunks, lossy)
            offset = resumed
            continue
        yield piece
        offset = piece.end
        ended = ended or piece.opcode == Opcode.DATA_END
        if piece.opcode == Opcode.CHUNK:
            index_end = piece.end + index_size(piece.record)


def index_size(chunk: Chunk) -> int:
    """Bytes of the message indices that follow a whole chunk."""
    messages = [body[:2] for opcode, body in inner(content(chunk)) if opcode == Opcode.MESSAGE]
    return INDEX_HEAD * len(set(messages)) + INDEX_ENTRY * len(messages)


def resume(source: Source, offset: int, end: int) -> tuple[int, int]:
    """Where the next whole record begins behind damage at `offset`, and the heads of chunks passed on the way."""
    chunks = 0
    while offset < end:
        after = chunk_end(source, offset)
        chunks += after > 0
        if offset < after < end and judge(source, after, end):
            return after, chunks
        offset = source.anchor(offset + 1, end)
        if offset < end and judge(source, offset, end):
            break
    return min(offset, end), chunks


class Summary(NamedTuple):
    """The end of a finished recording, where its checksum is right."""

    start: int
    records: list[tuple[int, Any]]


def summary(source: Source) -> Summary | None:
    """The summary of a finished recording; None where there is none, or a damaged one."""
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
    return Summary(start, [(opcode, parsed(opcode, body)) for opcode, body in inner(data)])
