"""A program in a process of its own that answers over its standard streams."""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import signal
import subprocess
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from typing import IO, Any

TRACEBACK = "Traceback (most recent call last):"
# types whose text is a sentence by itself; of others, such as KeyError, the type says what the text means
PLAIN = ("RuntimeError", "ValueError", "ModuleNotFoundError")
TYPED = re.compile(rf"^(?:{'|'.join(PLAIN)}): ")
TIDY_S = 0.5  # s in which a program that waits for input ends by itself, and deletes its temporary files
# begins the line in which a program gives the reason itself, whatever its own child processes write beside it
REASON = "rths: "
# text of an exception of a library that wrote the reason on standard error just before
BEFORE = "See stderr output"


class EndedError(Exception):
    """The program has ended; the text says why, as far as its standard error does."""


class PipedProgram:
    """The program of the command `words`, whose first line of input is `task` as JSON.

    It has a process group of its own, so that Ctrl-C, which the terminal sends to a whole group, does not reach it.
    `noise` is a part of the lines of its standard error that say nothing about a failure. `task["model"]` is the file
    of a user that it runs, if it runs one: of an exception in that file the line is told.

    Raises:
        OSError: it cannot be started.
    """

    def __init__(self, words: Sequence[str], task: Mapping[str, Any], noise: bytes = b"") -> None:
        self._noise, self._read, self._file = noise, b"", str(task.get("model", ""))
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
        """Why it ended: a signal, an exception with its line in the user's file, or its last line of standard error."""
        if self._said.closed:
            return "its process is closed"
        code: int | None = None
        with contextlib.suppress(subprocess.TimeoutExpired):
            code = self._process.wait(timeout=1.0)
        self._said.seek(0)
        lines = [line for line in self._said.read().splitlines() if line.strip()]
        lines = [line for line in lines if not self._noise or self._noise not in line]
        if code is not None and code < 0:
            return f"its process was ended by signal {-code}, {signal.strsignal(-code)}"
        if not lines:
            return f"its process said nothing{'' if code is None else f' and ended with exit code {code}'}"
        return reason([line.decode(errors="replace") for line in lines], self._file)


def reason(lines: Sequence[str], file: str = "") -> str:
    """The reason in what a program wrote on standard error, in one line.

    It is what follows `REASON` where a line begins so. Else, of an exception it is its text, with its type unless the
    text is a sentence by itself, and its line in the user's `file`. Else it is the last line.
    """
    if given := [line.removeprefix(REASON) for line in lines if line.startswith(REASON)]:
        return given[0].strip()
    marks = [number for number, line in enumerate(lines) if line == TRACEBACK]
    if not marks:
        return TYPED.sub("", lines[-1].strip())
    trace = lines[marks[-1] + 1 :]
    frames = [number for number, line in enumerate(trace) if line.startswith("  ")]
    text = " ".join(line.strip() for line in trace[frames[-1] + 1 if frames else 0 :])
    if text.endswith(BEFORE):
        text = lines[marks[-1] - 1].strip() if marks[-1] else text
    places = [
        found[1] for line in trace if (found := re.match(rf'\s+File "{re.escape(file)}", line (\d+)', line))
    ]
    at = f"line {places[-1]}: " if file and places else ""
    return at + TYPED.sub("", text)


def _end(process: subprocess.Popen[bytes], said: IO[bytes]) -> None:
    """End the process and close its streams; at the end of its input it may tidy up for a moment."""
    for stream in (process.stdin, process.stdout, said):
        if stream is not None and not stream.closed:
            with contextlib.suppress(BrokenPipeError):  # `close` flushes to a process that has ended
                stream.close()
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(TIDY_S)
    process.kill()
    process.wait()
