"""The progress of a command on standard error: a line rewritten in place on a terminal, plain lines elsewhere."""

from __future__ import annotations

import contextlib
import shutil
import sys
import threading
import time
from types import TracebackType
from typing import Self, TextIO

from common.terminal.printable import behind, shown
from report.text.formats import blocks

BAR = 24  # columns of the bar
UNSAID = 2.0  # s before the first line: shorter waits need no explanation
REDRAW = 0.25  # s between two lines on a terminal, which look continuous at that rate
EVERY = 5.0  # s between two lines in a file, at least, so that a log stays short


class Progress:
    """The progress of a command, shown as long as the context lasts, from `UNSAID` seconds on.

    A thread writes the lines, so that `tell` costs nothing in a loop and the seconds are counted while a kernel
    computes. On a terminal the line is wiped when the work ends, and stays if an error or Ctrl-C ends it.
    """

    def __init__(self, doing: str, stream: TextIO | None = None, began: float | None = None) -> None:
        self._doing = doing
        self._stream = behind(stream or sys.stderr)
        self._live = self._stream.isatty()
        self._began = time.monotonic() if began is None else began
        self._now: tuple[str, int, int] = ("", 0, 0)
        self._said: tuple[str, int, int] | None = None
        self._next = self._began + UNSAID
        self._width = 0  # of the line that is on the terminal
        self._ended = threading.Event()
        self._writer = threading.Thread(target=self._write, name="progress", daemon=True)

    def __enter__(self) -> Self:
        self._writer.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._writer.join()
        with contextlib.suppress(OSError, ValueError):
            self.leave(wipe=kind is None)

    def tell(self, what: str, done: int = 0, total: int = 0) -> None:
        """Set the present step: `what`, of which `done` of `total` are done where a total is known."""
        self._now = (what, done, total)

    def look(self, now: float) -> None:
        """Write what is due at a time of the monotonic clock, s."""
        if now < self._next or (not self._live and self._now == self._said):
            return
        self._said = self._now
        self._next = now + (REDRAW if self._live else EVERY)
        text = shown(self.text(now - self._began))
        if self._live:
            text = text[: shutil.get_terminal_size().columns - 1]
            self._stream.write("\r" + text.ljust(self._width))
            self._width = len(text)
        else:
            self._stream.write(text + "\n")
        self._stream.flush()

    def text(self, spent: float) -> str:
        """The line after this many seconds."""
        what, done, total = self._now
        counted = f"{done} of {total}" if total else ""
        parts = ", ".join(part for part in (what, counted, f"{spent:.0f} s") if part)
        bar = f"[{blocks(done / total, BAR)}] " if self._live and total else ""
        return f"{bar}{self._doing}: {parts}"

    def leave(self, *, wipe: bool) -> None:
        """Leave the terminal's line, which is wiped or stays."""
        if self._width:
            self._stream.write(f"\r{' ' * self._width}\r" if wipe else "\n")
            self._stream.flush()
            self._width = 0

    def _write(self) -> None:
        with contextlib.suppress(OSError, ValueError):  # the work goes on although nobody reads its progress
            while not self._ended.wait(REDRAW):
                self.look(time.monotonic())
