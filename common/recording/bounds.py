"""Bounds on the content of a recording by the size of its file, so that a hostile file cannot cost time and memory.

A test may last 7200 s at an interval of 0.1 ms with any number of slaves, so a bound on the number of messages could
not tell a long test from a hostile file, but the size of the file can. Recordings in which nothing moves compress best.
In these, as this software writes them, a message takes 23 bytes of the file, 16 of them in the index (7 where another
program has left the index out), and 1000 storeys at rest unpack to 165 times the file's size. The bounds lie beyond
both. Chunks need no bound of their own: each takes at least 57 bytes of the file, even if it is empty.
"""

from __future__ import annotations

from pathlib import Path

from common.errors import InputError

RECORD_BYTES = 4  # bytes of the file per record in its chunks; a genuine recording has 7 or more
FREE_RECORDS = 10_000  # allowed in a file of any size, since they are read in some hundredths of a second
UNPACKED = 256  # unpacked bytes per byte of the file; a genuine recording has 165 or fewer
FREE_BYTES = 64 << 20  # allowed in a file of any size: the largest chunk that is read


class Bounds:
    """Counts the records and bytes unpacked from the chunks of a file of `size` bytes."""

    def __init__(self, path: Path, size: int) -> None:
        self.path, self.size = path, size
        self._records = self._bytes = 0

    def unpack(self, size: int) -> None:
        """Count a chunk of this unpacked size (bytes); raises InputError where the total is beyond its bound."""
        self._bytes += size
        if self._bytes > FREE_BYTES + UNPACKED * self.size:
            raise self._beyond(f"unpacks to more than {UNPACKED} times its size")

    def record(self) -> None:
        """Count a record of a chunk; raises InputError where the total is beyond its bound."""
        self._records += 1
        if self._records > FREE_RECORDS + self.size // RECORD_BYTES:
            raise self._beyond(f"holds more than {self._records - 1} messages in {self.size} bytes")

    def _beyond(self, what: str) -> InputError:
        return InputError(
            f"{self.path} is not read further: it {what}, which no recording of a test does; copy the file from its "
            "source again, and do not trust it if the copy is the same."
        )
