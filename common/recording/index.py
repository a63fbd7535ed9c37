"""The index of a recording's chunks, kept compressed while it is being written: some 35 bytes per chunk."""

from __future__ import annotations

import zlib
from collections.abc import Iterator

from mcap.data_stream import RecordBuilder
from mcap.records import ChunkIndex
from mcap.writer import Writer

LIST = (
    "_Writer__chunk_indices"  # private attribute of the MCAP library's writer, which has no public way to it
)
LEVEL = 1  # of zlib, the fastest: the highest levels save only a tenth more


class ChunkIndexes:
    """Replaces the writer's list of chunk indexes, whose objects take some 700 bytes each.

    Twenty chunks a second would make the recorder's memory grow by 8 MB in ten minutes, for a summary that is written
    at the end. Encoded at once and compressed with those before it, the index of a chunk takes a twentieth of that.
    """

    def __init__(self) -> None:
        self._deflate = zlib.compressobj(LEVEL)
        self._packed = bytearray()

    def append(self, index: ChunkIndex) -> None:
        """Add the index of the next chunk."""
        builder = RecordBuilder()
        index.write(builder)
        encoded: bytes = builder.end()  # type: ignore[no-untyped-call]
        self._packed += self._deflate.compress(encoded)

    def __iter__(self) -> Iterator[ChunkIndexes]:
        """Yield this object alone: the writer calls `write` of each index, and this one writes all of them."""
        yield self

    def write(self, builder: RecordBuilder) -> None:
        """Write all indexes in order, as records of the summary."""
        rest = self._deflate.copy().flush()
        builder.write(zlib.decompress(self._packed + rest))


def pack_index(writer: Writer) -> None:
    """Let a writer keep its chunk indexes compressed; another version of the library only needs more memory."""
    if isinstance(getattr(writer, LIST, None), list):
        setattr(writer, LIST, ChunkIndexes())
