"""Checks plain rows and encodes them as MCAP messages with protobuf content, many in one call of a kernel.

The result equals byte by byte that of protobuf's own library and the MCAP library, in a tenth of their time: a test in
virtual time has some forty thousand messages per second. In proto3 a field that is 0 or false is left out; −0.0 is not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import itemgetter, ne

import numpy as np
import numpy.typing as npt

from common.recording.chunks import Block, Entries
from common.recording.rows import STAMPS, Item, is_plain, layouts
from common.signals import FieldType, Signal
from models.compiled import jit_apart

ByteArray = npt.NDArray[np.uint8]
Numbers = npt.NDArray[np.int64]

HEAD = 31  # bytes of an MCAP message record before its data: opcode, length, channel, sequence, both times
PREFIX = 9  # bytes of opcode and length, which the length does not count
OPCODE = 5  # of a message
LONGEST = 12  # largest number of bytes of a field without its numbers: a tag of two, and a length of ten
MOST = 10  # largest number of bytes of a number: that of a negative one
VARINT, DOUBLE, PACKED = 0, 1, 2  # how a field's value is stored: the low three bits of its tag
END, OF_DOUBLE, OF_COUNT, OF_INDEX, OF_STAMP, OF_FLAG = range(6)
FIRST = itemgetter(0)  # place of a channel's first message, by which the channels of a block are ordered
KIND, COUNT = range(2)  # columns of a table of fields
PEAK, TICK = range(2)  # columns of a table of peaks: the bits of the largest magnitude, and its tick
# The bits of a number without its sign order as magnitudes do; those of what is no number lie above those of infinity.
MAGNITUDE, INFINITE = (1 << 63) - 1, 0x7FF0000000000000

KINDS: Mapping[FieldType, int] = {
    FieldType.NUMBER: OF_DOUBLE,
    FieldType.STOREYS: OF_DOUBLE,
    FieldType.COUNT: OF_COUNT,
    FieldType.INDEX: OF_INDEX,
    FieldType.STAMP: OF_STAMP,
    FieldType.FLAG: OF_FLAG,
}  # codes of the kernels for the types of signals


class RowTable:
    """The plain topics among `topics` as tables for the kernels."""

    def __init__(self, topics: Mapping[str, Sequence[Signal]], storeys: int) -> None:
        plain = {topic: rows for topic, rows in topics.items() if is_plain(rows)}
        self.sizes = {topic: found.size for topic, found in layouts(plain, storeys).items()}
        self.names = tuple(plain)
        self._places = {topic: place for place, topic in enumerate(plain)}
        self.fields = np.zeros((len(plain), max(map(len, plain.values()), default=0) + 1, 2), dtype=np.int64)
        for place, rows in enumerate(plain.values()):
            for field, row in enumerate(rows):
                self.fields[place, field] = KINDS[row.kind], row.count(storeys)

    def gathered(self, topics: Sequence[str], rows: Sequence[bytes]) -> tuple[ByteArray, ByteArray]:
        """The rows one after the other, and the index of each row's topic."""
        places = bytes(map(self._places.__getitem__, topics))
        return np.frombuffer(b"".join(rows), dtype=np.uint8), np.frombuffer(places, dtype=np.uint8)

    def sound(self, topics: Sequence[str], rows: Sequence[bytes], ticks: int) -> bool:
        """Whether rows of plain topics have the right size, valid stamps, ticks below `ticks`, and flags of 0 or 1."""
        if any(map(ne, map(len, rows), map(self.sizes.__getitem__, topics))):
            return False
        return bool(check(*self.gathered(topics, rows), self.fields, ticks))


class RowEncoder:
    """Encodes rows of the plain topics among `topics`; `channels` are the file's channel numbers by topic."""

    def __init__(
        self, topics: Mapping[str, Sequence[Signal]], channels: Mapping[str, int], storeys: int
    ) -> None:
        self._table = RowTable(topics, storeys)
        self.sizes = self._table.sizes
        self._channels = [channels[topic] for topic in self._table.names]
        self._numbers = np.array(self._channels, dtype=np.int64)
        self._names = {
            topic: [row.name for row in rows if row.kind in (FieldType.NUMBER, FieldType.STOREYS)]
            for topic, rows in topics.items()
            if topic in self.sizes
        }
        counts = self._table.fields[:, :, COUNT]
        self._peaks = np.zeros((*counts.shape, 2), dtype=np.int64)
        self._most = HEAD + int(np.max(np.sum(LONGEST + MOST * counts, axis=1), initial=0))
        self._room(16)
        for topic, size in list(self.sizes.items())[:1]:  # compiles or loads the kernel before a test begins
            self.encode([(topic, bytes(size))])

    def peaks(self, topic: str) -> dict[str, tuple[float, int]]:
        """The largest magnitude of each real quantity of a plain topic so far, and its first tick, by name."""
        place = self._table.names.index(topic)
        real = self._table.fields[place, :, KIND] == OF_DOUBLE
        found = self._peaks[place, real]
        peaks = found[:, PEAK].copy().view(np.float64).tolist()
        return dict(zip(self._names[topic], zip(peaks, found[:, TICK].tolist(), strict=True), strict=True))

    def _room(self, rows: int) -> None:
        self._entries = np.zeros((rows, 2), dtype=np.int64)
        self._records = np.zeros(rows * self._most, dtype=np.uint8)
        self._ends = np.zeros(len(self._channels) + 3, dtype=np.int64)

    def encode(self, items: Sequence[Item]) -> Block:
        """The encoded messages of items, whose topics must be plain."""
        if len(items) > len(self._entries):
            self._room(2 * len(items))
        rows, places = self._table.gathered(*zip(*items, strict=True))
        pack(rows, places, self._table.fields, self._numbers, self._records, self._entries, self._ends)
        note_peaks(rows, places, self._table.fields, self._peaks)
        *ends, first, last, size = self._ends.tolist()
        return Block(self._records[:size].data, self._dealt(ends), first, last)

    def _dealt(self, ends: Sequence[int]) -> dict[int, Entries]:
        """The entries of each channel, which stand topic by topic; the channel of the first message comes first."""
        begins = [0, *ends[:-1]]
        found = [
            (self._entries.item(begin, 1), channel, self._entries[begin:end])
            for channel, begin, end in zip(self._channels, begins, ends, strict=True)
            if end > begin
        ]
        return {channel: entries for _, channel, entries in sorted(found, key=FIRST)}


@jit_apart
def put_varint(out: ByteArray, at: int, number: int) -> int:
    """Write a number in groups of seven bits, the lowest first, all but the last with the eighth bit.

    Returns the end.
    """
    rest = number
    while rest & -128:
        out[at] = (rest & 127) | 128
        rest = (rest >> 7) & 0x01FFFFFFFFFFFFFF
        at += 1
    out[at] = rest
    return at + 1


@jit_apart
def varint_size(number: int) -> int:
    """The number of bytes that `put_varint` needs."""
    rest, size = number, 1
    while rest & -128:
        rest = (rest >> 7) & 0x01FFFFFFFFFFFFFF
        size += 1
    return size


@jit_apart
def copied(source: ByteArray, begin: int, out: ByteArray, at: int, count: int) -> bool:
    """Copy bytes; returns whether any of them is not 0."""
    some = 0
    for place in range(count):
        byte = source[begin + place]
        out[at + place] = byte
        some |= byte
    return some != 0


@jit_apart
def whole(source: ByteArray, begin: int, count: int) -> int:
    """The whole number in little-endian bytes."""
    number = np.int64(0)
    for place in range(count):
        number |= np.int64(source[begin + place]) << np.int64(8 * place)
    return number  # type: ignore[return-value]


@jit_apart
def size_of(kind: int) -> int:
    """The number of bytes of a number of this kind in a row."""
    if kind in (OF_DOUBLE, OF_STAMP):
        return 8
    return 1 if kind == OF_FLAG else 4


@jit_apart
def number_of(rows: ByteArray, begin: int, kind: int) -> int:
    """The whole number of this kind at a place of a row."""
    number = whole(rows, begin, size_of(kind))
    if kind == OF_INDEX and number >= 1 << 31:
        number -= 1 << 32
    return number


@jit_apart
def put_one(rows: ByteArray, begin: int, field: int, kind: int, out: ByteArray, at: int) -> int:
    """Write a field of one number, unless it is 0; returns the end of the message so far."""
    if kind == OF_DOUBLE:
        after = put_varint(out, at, (field + 1) << 3 | DOUBLE)
        return after + 8 if copied(rows, begin, out, after, 8) else at
    number = number_of(rows, begin, kind)
    if number:
        at = put_varint(out, put_varint(out, at, (field + 1) << 3 | VARINT), number)
    return at


@jit_apart
def put_several(
    rows: ByteArray, begin: int, field: int, kind: int, count: int, out: ByteArray, at: int
) -> int:
    """Write a field of several numbers, packed; returns the end of the message so far."""
    at = put_varint(out, at, (field + 1) << 3 | PACKED)
    if kind == OF_DOUBLE:
        at = put_varint(out, at, 8 * count)
        copied(rows, begin, out, at, 8 * count)
        return at + 8 * count
    size, step = 0, size_of(kind)
    for place in range(count):
        size += varint_size(number_of(rows, begin + step * place, kind))
    at = put_varint(out, at, size)
    for place in range(count):
        at = put_varint(out, at, number_of(rows, begin + step * place, kind))
    return at


@jit_apart
def put_fields(rows: ByteArray, begin: int, fields: Numbers, out: ByteArray, at: int) -> tuple[int, int]:
    """Write the protobuf message of a row's values; returns the ends of the row and of the message."""
    for field in range(fields.shape[0]):
        kind, count = fields[field, KIND], fields[field, COUNT]
        if kind == END:
            break
        if count == 1:
            at = put_one(rows, begin, field, kind, out, at)
        else:
            at = put_several(rows, begin, field, kind, count, out, at)
        begin += count * size_of(kind)
    return begin, at


@jit_apart
def pack(
    rows: ByteArray,
    topics: ByteArray,
    fields: Numbers,
    channels: Numbers,
    out: ByteArray,
    entries: Numbers,
    ends: Numbers,
) -> None:
    """Write MCAP records of rows into `out`, their log times and offsets topic by topic into `entries`.

    `ends` receives the end of each topic's entries and, at its own end, earliest and latest log time, and the number of
    bytes in `out`.
    """
    divide(topics, ends)
    begin = at = 0
    first = last = whole(rows, 0, 8)
    for row in range(topics.shape[0]):
        topic, start, time = topics[row], at, whole(rows, begin, 8)
        entries[ends[topic], 0], entries[ends[topic], 1] = time, start
        ends[topic] += 1
        first, last = min(first, time), max(last, time)
        copied(rows, begin, out, start + HEAD - STAMPS, STAMPS)
        copied(rows, begin + STAMPS, out, start + PREFIX + 2, 4)  # the sequence is the tick
        begin, at = put_fields(rows, begin + STAMPS, fields[topic], out, start + HEAD)
        out[start] = OPCODE
        for place in range(8):
            out[start + 1 + place] = ((at - start - PREFIX) >> (8 * place)) & 255
        out[start + PREFIX], out[start + PREFIX + 1] = channels[topic] & 255, channels[topic] >> 8
    ends[-3], ends[-2], ends[-1] = first, last, at


@jit_apart
def divide(topics: ByteArray, ends: Numbers) -> None:
    """Write into `ends` where the entries of each topic begin; `pack` moves each of them on to its end."""
    ends[:] = 0
    for row in range(topics.shape[0]):
        ends[topics[row] + 1] += 1
    for topic in range(1, ends.shape[0]):
        ends[topic] += ends[topic - 1]


@jit_apart
def note_peaks(rows: ByteArray, topics: ByteArray, fields: Numbers, peaks: Numbers) -> None:
    """Note in `peaks` the real quantities of rows that are larger than all before; a NaN is not."""
    begin = 0
    for row in range(topics.shape[0]):
        begin += STAMPS
        tick = whole(rows, begin, 4)
        for field in range(fields.shape[1]):
            kind = fields[topics[row], field, KIND]
            if kind == END:
                break
            for _ in range(fields[topics[row], field, COUNT]):
                if kind == OF_DOUBLE:
                    bits = whole(rows, begin, 8) & MAGNITUDE
                    if bits <= INFINITE and bits > peaks[topics[row], field, PEAK]:
                        peaks[topics[row], field, PEAK], peaks[topics[row], field, TICK] = bits, tick
                begin += size_of(kind)


@jit_apart
def check(rows: ByteArray, topics: ByteArray, fields: Numbers, ticks: int) -> bool:
    """Whether all rows have stamps of at least 0, ticks below `ticks`, and flags of 0 or 1."""
    begin = 0
    for row in range(topics.shape[0]):
        if whole(rows, begin, 8) < 0 or whole(rows, begin + 8, 8) < 0:
            return False
        begin += STAMPS
        if whole(rows, begin, 4) >= ticks:
            return False
        for field in range(fields.shape[1]):
            kind = fields[topics[row], field, KIND]
            if kind == END:
                break
            for _ in range(fields[topics[row], field, COUNT]):
                if kind == OF_FLAG and rows[begin] > 1:
                    return False
                begin += size_of(kind)
    return True
