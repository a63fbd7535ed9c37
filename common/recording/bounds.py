"""What a recording of some size can hold: bounds that stop a hostile file before it costs time and memory.

A test may last 7200 s at an interval of 0.1 ms with any number of slaves, so no bound on messages alone would tell a
long test from a hostile file. What tells them apart is the size of the file. The recordings that pack best are those
in which nothing ever moves. Of these, written by this software, a message takes 23 bytes of the file, 16 of them in the
index (7 where another program has left the index out); and 1000 storeys at rest unpack to 165 times the file's size.
The bounds lie beyond both. Chunks need none of their own: each takes at least 57 bytes of the file, empty or not.
"""

from __future__ import annotations

from pathlib import Path

from common.errors import InputError

RECORD_BYTES = 4  # of the file for each record in its chunks; the least of an honest one is 7
FREE_RECORDS = 10_000  # of a short file, read in some hundredths of a second
UNPACKED = 256  # bytes per byte of the file; the most of an honest one is 165
FREE_BYTES = 64 << 20  # of a short file: the largest chunk that is read at all


class Bounds:
    """Counts what is taken out of the chunks of a file, which may grow to `size` bytes."""

    def __init__(self, path: Path, size: int) -> None:
        self.path, self.size = path, size
        self._records = self._bytes = 0

    def unpack(self, size: int) -> None:
        """Count a chunk by the size that it will have unpacked; raises InputError where that is too much."""
        self._bytes += size
        if self._bytes > FREE_BYTES + UNPACKED * self.size:
            raise self._beyond(f"unpacks to more than {UNPACKED} times its size")

    def record(self) -> None:
        """Count a record of a chunk; raises InputError where there are too many."""
        self._records += 1
        if self._records > FREE_RECORDS + self.size // RECORD_BYTES:
            raise self._beyond(f"holds more than {self._records - 1} messages in {self.size} bytes")

    def _beyond(self, what: str) -> InputError:
        return InputError(
            f"{self.path} is not read on: it {what}, which no recording of a test does; get the file from its source "
            "again, and do not trust it if it is the same."
        )
