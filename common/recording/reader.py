"""Reads a recording, finished, cut off, or still being written.

The recorder hands whole records to the operating system some twenty times a second, so a running test can be followed
in the file itself: the writer neither knows its readers nor waits for them.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from functools import partial
from math import inf
from pathlib import Path
from types import TracebackType
from typing import Self

from mcap.opcode import Opcode
from mcap.records import Chunk, McapRecord, Message, Statistics
from mcap.writer import MCAP0_MAGIC

from common.errors import InputError
from common.recording.bounds import Bounds
from common.recording.contents import Contents
from common.recording.records import (
    DAMAGE,
    HEAD,
    MESSAGE,
    GrowingFile,
    content,
    framed,
    inner,
    parsed,
    summary,
)
from common.recording.run import Run

LOOK_BYTES = 1 << 20  # of the file per look: some seconds of a test, decoded in a few tens of milliseconds
# the records that are read; others are skipped
WANTED = frozenset({Opcode.CHUNK, Opcode.METADATA, Opcode.ATTACHMENT})
FOOTER_BYTES = 20  # of its body: two offsets and a checksum
INDEX = struct.Struct("<HI")  # the beginning of a message index: its channel, and the bytes of its entries


def read(path: Path, *, messages: bool = True) -> Run:
    """Read a recording, finished or cut off.

    Without `messages` the columns stay empty and there are no events; every chunk is still checked for damage.

    Raises:
        InputError: the file cannot be read, is no MCAP file, or holds nothing of a hybrid test.
    """
    with Tail(path, messages=messages) as tail:
        tail.open()
        run = tail.look(inf)
    if tail.place <= len(MCAP0_MAGIC) and (tail.damage or not tail.place):
        raise _unreadable(path, tail.cause or "it is too short")
    if tail.misfit:
        raise tail.misfit
    if not run.columns and not run.events:
        raise InputError(f"{path} is an MCAP file, but holds no topic rths/<test>/<name>.")
    return run


def length(path: Path) -> float:
    """Seconds from the first to the last message of a finished recording, by its summary; 0 where it has none."""
    try:
        with path.open("rb") as stream:
            found = summary(GrowingFile(stream))
    except (OSError, *DAMAGE):
        return 0.0
    times = [
        (record.message_end_time - record.message_start_time) * 1e-9
        for record in (found.records if found else ())
        if isinstance(record, Statistics)
    ]
    return max(times, default=0.0)


def _unreadable(path: Path, cause: str) -> InputError:
    return InputError(
        f"{path} is not a readable MCAP recording: {cause}; if it was one, `rths recover` saves the undamaged part."
    )


class Tail:
    """A recording that may still grow, read further with every look; as a context it closes the file.

    `place` is the offset after the newest whole record. `damage` tells why reading ended before the end of the file,
    and `cause` what is wrong there; both are empty while nothing is. `behind` tells whether the file holds more than
    was read, and `finished` whether the recorder has closed the file.
    """

    def __init__(self, path: Path, *, messages: bool = True) -> None:
        self.path = path
        self._unpacked = partial(unpacked, messages=messages)
        self.place = 0
        self.finished = self.behind = False
        self.damage = self.cause = ""
        self.misfit: InputError | None = None  # raised where messages do not fit their schema
        self._stream: io.BufferedReader | None = None
        self._last = 0  # opcode of the newest whole record
        self._contents = Contents()
        self._bounds = Bounds(path, 0)
        self._metadata: dict[str, dict[str, str]] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._stream is not None:
            self._stream.close()

    def open(self) -> None:
        """Open the file; raises InputError where that cannot be done."""
        try:
            self._stream = self.path.open("rb")
        except OSError as error:
            raise InputError(
                f"Cannot read the recording {self.path}: {error.strerror}; give the path of a file (MCAP)."
            ) from None

    def look(self, most: float = LOOK_BYTES) -> Run:
        """The messages since the last look, from at most `most` bytes of the file and one record; all metadata so far.

        A record that is not whole yet is left for the next look, and so is a file that does not exist yet.

        Raises:
            InputError: the file cannot be read, is no MCAP file, or holds more than any recording of its size does.
        """
        run = Run(self.path, metadata=dict(self._metadata))
        if self._stream is None and self.path.exists():
            self.open()
        try:
            if self._stream is not None:
                self._read(GrowingFile(self._stream), most, run)
        except OSError as error:
            raise InputError(f"Cannot read the recording {self.path}: {error.strerror}.") from None
        try:
            self._contents.decode(run)
        except InputError as error:
            self.misfit = error
            self._end(str(error))
        if run.damage and not self.damage:
            self._end(run.damage)
        run.finished, run.damage = self.finished, self.damage
        self._metadata = dict(run.metadata)
        return run

    def _end(self, damage: str) -> None:
        self.damage, self.behind = damage, False

    def _read(self, source: GrowingFile, most: float, run: Run) -> None:
        self._bounds.size = source.size
        if source.size < self.place:
            self._end("it was cut off or begun anew while it was read")
        if not self._begun(source):
            return
        try:
            for found in self._wanted(source, self.place + most):
                for record in list(self._unpacked(parsed(found), self._bounds)):
                    self._contents.take(record, run)
        except DAMAGE as error:
            self._end(f"at byte {self.place}")
            self.cause = str(error) or type(error).__name__

    def _begun(self, source: GrowingFile) -> bool:
        """Whether the file holds the magic bytes with which every MCAP file begins."""
        if not self.place:
            begin = source.at(0, len(MCAP0_MAGIC))
            if begin != MCAP0_MAGIC[: len(begin)]:
                raise _unreadable(self.path, "it does not begin as one")
            self.place = len(begin) if begin == MCAP0_MAGIC else 0
        return self.place > 0

    def _wanted(self, source: GrowingFile, limit: float) -> Iterator[bytes]:
        """The wanted whole records up to an offset; each counts as read when the next one is requested."""
        self.behind = False
        while not (self.finished or self.damage) and (frame := framed(source, self.place, source.size)):
            opcode, after = frame
            if self.place >= limit:
                self.behind = True
                return
            self._check_kind(source, opcode, after)
            if opcode in WANTED:
                yield source.at(self.place, after - self.place)
            self.place, self._last = after, opcode
            self.finished = opcode == Opcode.FOOTER

    def _check_kind(self, source: GrowingFile, opcode: int, after: int) -> None:
        """Raise ValueError where the next record cannot be of its kind: no checksum covers the byte that says it.

        A chunk that is read as another kind would be skipped with its samples. The indices of its messages follow it.
        """
        body = after - self.place - HEAD.size
        if opcode == Opcode.FOOTER and body != FOOTER_BYTES:
            raise ValueError("a footer of another size")
        if opcode != Opcode.MESSAGE_INDEX:
            return
        if self._last not in (Opcode.CHUNK, Opcode.MESSAGE_INDEX):
            raise ValueError("an index of messages without a chunk")
        _, entries = INDEX.unpack(source.at(self.place + HEAD.size, INDEX.size))
        if body != INDEX.size + entries:
            raise ValueError("an index of messages of another size")


def unpacked(record: McapRecord, bounds: Bounds, *, messages: bool = True) -> Iterator[McapRecord]:
    """The records of a chunk, or the record itself; without `messages`, the definitions before the first message.

    Definitions and messages are read from chunks alone, which have a checksum; it is checked for the whole chunk.

    Raises:
        ValueError: a chunk is damaged.
        InputError: the file holds more than a recording of its size can.
    """
    if not isinstance(record, Chunk):
        yield record
        return
    data = content(record)
    bounds.unpack(len(data))
    for opcode, found in inner(data):
        if opcode == Opcode.MESSAGE and not messages:
            return
        bounds.record()
        if opcode == Opcode.MESSAGE:
            channel, sequence, log_ns, publish_ns = MESSAGE.unpack_from(found, HEAD.size)
            yield Message(channel, log_ns, found[HEAD.size + MESSAGE.size :], publish_ns, sequence)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            yield parsed(found)
