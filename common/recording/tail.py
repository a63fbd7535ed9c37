"""Following a recording while it is written: what has come since the last look, decoded like a whole one.

The recorder hands whole records to the operating system some twenty times a second, so the file itself is the stream:
the writer neither knows its readers nor waits for them.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from mcap.opcode import Opcode
from mcap.records import Statistics
from mcap.writer import MCAP0_MAGIC

from common.errors import InputError
from common.recording.bounds import Bounds
from common.recording.reader import Contents, Run, unpacked
from common.recording.salvage import DAMAGE, HEAD, RECORD_LIMIT, Source, parsed, summary

LOOK_BYTES = 1 << 20  # of the file per look: some seconds of a test, decoded in a few tens of milliseconds
WANTED = frozenset({Opcode.CHUNK, Opcode.METADATA, Opcode.ATTACHMENT})  # of the rest the place alone matters


def length(path: Path) -> float:
    """Seconds from the first to the last message of a finished recording, by its summary; 0 where it has none."""
    try:
        with path.open("rb") as stream:
            found = summary(Source(stream))
    except (OSError, *DAMAGE):
        return 0.0
    times = [
        (record.message_end_time - record.message_start_time) * 1e-9
        for _, record in (found.records if found else ())
        if isinstance(record, Statistics)
    ]
    return max(times, default=0.0)


class Tail:
    """A recording that may still grow, read on from look to look; a context that closes the file.

    `damage` says why reading has ended before the file's end, empty while it has not; `behind` whether there is more
    to be had at once; `finished` whether the recorder has closed the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.finished = False
        self.damage = ""
        self.behind = False
        self._stream: io.BufferedReader | None = None
        self._place = 0
        self._contents = Contents()
        self._bounds = Bounds(path, 0)
        self._metadata: dict[str, dict[str, str]] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None

    def look(self, most: int = LOOK_BYTES) -> Run:
        """What is new, of at most `most` bytes of the file and one record more; its metadata are all so far.

        A record that is not whole yet is left for the next look, and so is a file that does not exist yet.

        Raises:
            InputError: the file cannot be read, or is no MCAP file.
        """
        run = Run(self.path, metadata=dict(self._metadata))
        try:
            source = self._opened()
            if source and not (self.finished or self.damage):
                self._read(source, most, run)
        except OSError as error:
            raise InputError(f"Cannot read the recording {self.path}: {error.strerror}.") from None
        try:
            self._contents.decode(run)
        except InputError as error:
            self._end(str(error))
        self.damage = self.damage or run.damage
        run.finished, run.damage = self.finished, self.damage
        self._metadata = dict(run.metadata)
        return run

    def _end(self, damage: str) -> None:
        self.damage, self.behind = damage, False

    def _read(self, source: Source, most: int, run: Run) -> None:
        self._bounds.size = source.size
        try:
            for record in self._records(source, self._place + most):
                for each in list(unpacked(record, self._bounds)):
                    self._contents.take(each, run)
        except DAMAGE:
            self._end(f"at byte {self._place}")

    def _records(self, source: Source, limit: int) -> Iterator[Any]:
        """Whole records from here on; each counts as read when the next one is asked for.

        Raises:
            ValueError: there is something else.
        """
        self.behind = False
        while not self.finished and len(head := source.at(self._place, HEAD.size)) == HEAD.size:
            opcode, length = HEAD.unpack(head)
            after = self._place + HEAD.size + length
            if length > RECORD_LIMIT:
                raise ValueError("a record is larger than any of a recording")
            self.behind = self._place >= limit and after <= source.size
            if after > source.size or self.behind:
                return
            if opcode in WANTED:
                yield parsed(opcode, source.at(self._place + HEAD.size, length))
            self._place = after
            self.finished = opcode == Opcode.FOOTER

    def _opened(self) -> Source | None:
        """The file as far as it is written by now; None where it has not begun yet."""
        if self._stream is None:
            try:
                self._stream = self.path.open("rb")
            except FileNotFoundError:
                return None
        source = Source(self._stream)
        if source.size < self._place:
            self._end("it was cut off or begun anew while it was read")
        if not self._place:
            begin = source.at(0, len(MCAP0_MAGIC))
            if begin != MCAP0_MAGIC[: len(begin)]:
                raise InputError(f"{self.path} is no MCAP recording.")
            self._place = len(begin) if begin == MCAP0_MAGIC else 0
        return source if self._place else None
