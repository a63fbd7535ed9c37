"""Rows of numbers as MCAP messages with their protobuf content, many in one call of a compiled kernel.

Byte for byte it is what protobuf's own library and the MCAP library write, in a tenth of their time: a test in virtual
time has some forty thousand messages per second. In proto3 a field that holds 0 or false is left out; −0.0 is not 0.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from common.recording.chunks import Block
from common.signals import FieldType, Signal
from models.compiled import jit_apart

Bytes = npt.NDArray[np.uint8]
Numbers = npt.NDArray[np.int64]

STAMPS = 16  # bytes of log and publish time, with which a row begins
HEAD = 31  # bytes of an MCAP message record before its data: opcode, length, channel, sequence, both times
PREFIX = 9  # bytes of opcode and length, which the length does not count
OPCODE = 5  # of a message
LONGEST = 12  # bytes of a field at most: a tag of two, and ten of a negative number
VARINT, DOUBLE = 0, 1  # how a field's value is stored: the low three bits of its tag
END, OF_DOUBLE, OF_COUNT, OF_INDEX, OF_STAMP, OF_FLAG = range(6)

# of each kind of signal, how a row holds it and how the kernel names it
HELD: Mapping[FieldType, tuple[str, int]] = {
    FieldType.NUMBER: ("d", OF_DOUBLE),
    FieldType.STOREYS: ("d", OF_DOUBLE),
    FieldType.COUNT: ("I", OF_COUNT),
    FieldType.INDEX: ("i", OF_INDEX),
    FieldType.STAMP: ("q", OF_STAMP),
    FieldType.FLAG: ("?", OF_FLAG),
}


def is_plain(rows: Sequence[Signal], storeys: int) -> bool:
    """Whether a topic has one number per signal, its tick first."""
    return rows[0].kind is FieldType.COUNT and all(
        row.kind in HELD and row.count(storeys) == 1 for row in rows
    )


def layout(rows: Sequence[Signal]) -> struct.Struct:
    """A row of a plain topic: log and publish time, and the values in the order of the signal table."""
    return struct.Struct("<QQ" + "".join(HELD[row.kind][0] for row in rows))


class RowEncoder:
    """Encodes rows of the plain topics among `topics`; `channels` are the numbers under which a file knows them."""

    def __init__(
        self, topics: Mapping[str, Sequence[Signal]], channels: Mapping[str, int], storeys: int
    ) -> None:
        plain = {topic: rows for topic, rows in topics.items() if is_plain(rows, storeys)}
        self.layouts = {topic: layout(rows) for topic, rows in plain.items()}
        self._places = {topic: place for place, topic in enumerate(plain)}
        self._channels = [channels[topic] for topic in plain]
        self._numbers = np.array(self._channels, dtype=np.int64)
        fields = np.zeros((len(plain), max(map(len, plain.values()), default=0) + 1), dtype=np.int64)
        for place, rows in enumerate(plain.values()):
            fields[place, : len(rows)] = [HELD[row.kind][1] for row in rows]
        self._fields = fields
        self._most = HEAD + LONGEST * fields.shape[1]
        self._room(16)
        for topic in list(plain)[:1]:  # the kernel is compiled, or its code loaded, before a test begins
            self.encode([topic], [bytes(self.layouts[topic].size)])

    def _room(self, rows: int) -> None:
        self._entries = np.zeros((rows, 2), dtype=np.int64)
        self._records = np.zeros(rows * self._most, dtype=np.uint8)
        self._size = np.zeros(1, dtype=np.int64)

    def encode(self, topics: Sequence[str], rows: Sequence[bytes]) -> Block:
        """The messages of rows, each held as its topic's layout says."""
        if len(rows) > len(self._entries):
            self._room(2 * len(rows))
        places = bytes([self._places[topic] for topic in topics])
        pack(
            np.frombuffer(b"".join(rows), dtype=np.uint8),
            np.frombuffer(places, dtype=np.uint8),
            self._fields,
            self._numbers,
            self._records,
            self._entries,
            self._size,
        )
        channels = self._channels
        return Block(
            self._records[: self._size[0]].data,
            [channels[place] for place in places],
            self._entries[: len(rows)].tolist(),
        )


@jit_apart
def put_varint(out: Bytes, at: int, number: int) -> int:
    """A number in groups of seven bits, the lowest first; all but the last have the eighth bit set. Its end."""
    rest = number
    while rest & -128:
        out[at] = (rest & 127) | 128
        rest = (rest >> 7) & 0x01FFFFFFFFFFFFFF
        at += 1
    out[at] = rest
    return at + 1


@jit_apart
def copied(source: Bytes, begin: int, out: Bytes, at: int, count: int) -> bool:
    """Copy bytes; whether any of them is not 0."""
    some = 0
    for place in range(count):
        byte = source[begin + place]
        out[at + place] = byte
        some |= byte
    return some != 0


@jit_apart
def whole(source: Bytes, begin: int, count: int) -> int:
    """The whole number that some bytes hold, the lowest first."""
    number = np.int64(0)
    for place in range(count):
        number |= np.int64(source[begin + place]) << np.int64(8 * place)
    return number  # type: ignore[return-value]


@jit_apart
def put_fields(rows: Bytes, begin: int, kinds: Numbers, out: Bytes, at: int) -> tuple[int, int]:
    """The protobuf message of a row's values; the ends of the row and of the message."""
    for field in range(kinds.shape[0]):
        kind = kinds[field]
        if kind == END:
            break
        if kind == OF_DOUBLE:
            after = put_varint(out, at, (field + 1) << 3 | DOUBLE)
            if copied(rows, begin, out, after, 8):
                at = after + 8
            begin += 8
            continue
        size = 8 if kind == OF_STAMP else 1 if kind == OF_FLAG else 4
        number = whole(rows, begin, size)
        if kind == OF_INDEX and number >= 1 << 31:
            number -= 1 << 32
        if number:
            at = put_varint(out, put_varint(out, at, (field + 1) << 3 | VARINT), number)
        begin += size
    return begin, at


@jit_apart
def pack(
    rows: Bytes,
    topics: Bytes,
    fields: Numbers,
    channels: Numbers,
    out: Bytes,
    entries: Numbers,
    size: Numbers,
) -> None:
    """The MCAP records of rows, with each one's log time and place, and the `size` of all of them, bytes."""
    begin = at = 0
    for row in range(topics.shape[0]):
        topic, start = topics[row], at
        entries[row, 0], entries[row, 1] = whole(rows, begin, 8), start
        copied(rows, begin, out, start + HEAD - STAMPS, STAMPS)
        copied(rows, begin + STAMPS, out, start + PREFIX + 2, 4)  # the sequence is the tick
        begin, at = put_fields(rows, begin + STAMPS, fields[topic], out, start + HEAD)
        out[start] = OPCODE
        for place in range(8):
            out[start + 1 + place] = ((at - start - PREFIX) >> (8 * place)) & 255
        out[start + PREFIX], out[start + PREFIX + 1] = channels[topic] & 255, channels[topic] >> 8
    size[0] = at
