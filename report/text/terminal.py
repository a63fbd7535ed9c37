"""What commands write on the terminal: tables, and the progress of a test."""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TextIO

from common.terminal.plain_report import LINE_EVERY, facts
from common.terminal.printable import behind, shown
from report.text.board import Board, coloured


class TitledTable(NamedTuple):
    """A table of a terminal or a page, with what stands over it."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]


def table(rows: Sequence[Sequence[str]], stream: TextIO | None = None) -> None:
    """Write rows in aligned columns, the first column to the left, the others to the right."""
    rows = [[shown(cell) for cell in row] for row in rows]
    widths = [max(len(row[place]) for row in rows) for place in range(len(rows[0]))]
    for row in rows:
        cells = [
            row[0].ljust(widths[0]),
            *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)),
        ]
        (stream or sys.stdout).write("  ".join(cells).rstrip() + "\n")


class RunProgress:
    """Progress of a test: a bar and sparklines on a terminal, plain lines now and then elsewhere (default: stderr).

    A terminal that is closed, or a pipe whose reader has gone, does not end a test.
    """

    def __init__(self, duration: float, stream: TextIO | None = None) -> None:
        self._duration = duration
        self._stream = behind(stream or sys.stderr)
        self._live = self._stream.isatty() and os.environ.get("TERM") != "dumb"
        self._next = 0.0
        self._board = Board(duration)
        self._drawn = 0  # lines of the board that are on the terminal

    def show(self, data: Mapping[str, Any]) -> None:
        """Show one report of progress."""
        t = float(data["t"])
        if self._live:
            self._board.take(data)
            self._draw()
        elif t >= self._next:
            self._next = t + LINE_EVERY
            self._put(facts(data, self._duration) + "\n")

    def mode(self, lab: str, mode: str) -> None:
        """Show a laboratory's safety mode."""
        self._board.modes[lab] = mode
        if self._drawn:
            self._draw()

    def say(self, text: str) -> None:
        """A line of its own, above the board."""
        drawn = self._drawn
        self._clear()
        self._put(shown(text) + "\n")
        if drawn:
            self._draw()

    def end(self) -> None:
        """Leave the board as it stands: what follows comes below."""
        self._drawn = 0

    def _draw(self) -> None:
        columns, rows = size_of(self._stream)
        lines = self._board.lines(columns - 1)[: max(rows - 1, 1)]  # a full last column or row would scroll
        self._clear()
        self._put("".join(coloured(line) + "\n" for line in lines))
        self._drawn = len(lines)

    def _clear(self) -> None:
        """Take the board off the terminal."""
        if self._drawn:
            self._put(f"\x1b[{self._drawn}A\r\x1b[J")
            self._drawn = 0

    def _put(self, text: str) -> None:
        with contextlib.suppress(OSError):
            self._stream.write(text)
            self._stream.flush()


def size_of(stream: TextIO) -> tuple[int, int]:
    """Columns and rows of the terminal behind a stream."""
    try:
        return os.get_terminal_size(stream.fileno())
    except (OSError, ValueError):
        return shutil.get_terminal_size()
