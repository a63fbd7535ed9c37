"""A program in a process of its own that answers over its standard streams."""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import subprocess
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from typing import IO, Any


class EndedError(Exception):
    """The program has ended; the text is the last line of its standard error."""


class PipedProgram:
    """The program of the command `words`, whose first line of input is `task` as JSON.

    It has a process group of its own, so that Ctrl-C, which the terminal sends to a whole group, does not reach it.
    `noise` is a part of the lines of its standard error that say nothing about a failure.

    Raises:
        OSError: it cannot be started.
    """

    def __init__(self, words: Sequence[str], task: Mapping[str, Any], noise: bytes = b"") -> None:
        self._noise, self._read = noise, b""
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        try:
            self._process = subprocess.Popen(
                words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said, process_group=0
            )
        except OSError:
            self._said.close()
            raise
        self.close: Callable[[], object] = weakref.finalize(self, _end, self._process, self._said)
        with contextlib.suppress(EndedError):  # the first answer says so
            self.send(json.dumps(task).encode() + b"\n")

    def send(self, data: bytes) -> None:
        """Send some bytes; raises EndedError."""
        assert self._process.stdin is not None  # noqa: S101 - it is a pipe
        try:
            self._process.stdin.write(data)
            self._process.stdin.flush()
        except (BrokenPipeError, ValueError):
            raise EndedError(self.last_words()) from None

    def answer(self, size: int, seconds: float | None = None) -> bytes | None:
        """Its next `size` bytes, or None after that many seconds without them; raises EndedError where it has ended."""
        assert self._process.stdout is not None  # noqa: S101 - it is a pipe
        while len(self._read) < size:
            try:
                if not select.select([self._process.stdout], [], [], seconds)[0]:
                    return None
                data = os.read(self._process.stdout.fileno(), size - len(self._read))
            except ValueError:  # closed here
                data = b""
            if not data:
                raise EndedError(self.last_words())
            self._read += data
        found, self._read = self._read, b""
        return found

    def last_words(self) -> str:
        """The last line of its standard error, without the type of an exception."""
        if self._said.closed:
            return "its process is closed"
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=1.0)
        self._said.seek(0)
        lines = [line for line in self._said.read().splitlines() if line.strip()]
        lines = [line for line in lines if not self._noise or self._noise not in line]
        last = lines[-1].decode(errors="replace").strip() if lines else "it said nothing"
        return re.sub(r"^\w+Error: ", "", last)


def _end(process: subprocess.Popen[bytes], said: IO[bytes]) -> None:
    """End the process and close its streams."""
    process.kill()
    for stream in (process.stdin, process.stdout, said):
        if stream is not None and not stream.closed:
            with contextlib.suppress(BrokenPipeError):  # `close` flushes to a process that has ended
                stream.close()
    process.wait()
