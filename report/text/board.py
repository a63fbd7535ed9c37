"""The lines on a terminal while a test runs: its progress, sparklines of its signals, the laboratories' states."""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from common.safety.modes import Mode
from common.terminal.plain_report import reached
from common.terminal.printable import shown

BLOCKS = "▁▂▃▄▅▆▇█"
BAR = 24  # columns of the progress bar
KEPT = 200  # reports kept: more than a sparkline has columns
BLUE, YELLOW, RED = "34", "33", "31"
IN_MODE = {
    Mode.RUNNING.value: BLUE,
    Mode.HOLDING.value: YELLOW,
    Mode.RAMPING.value: YELLOW,
    Mode.SAFE.value: RED,
    Mode.EMERGENCY_STOP.value: RED,
}


class Span(NamedTuple):
    """Some text in one colour, empty for the terminal's own."""

    text: str
    colour: str = ""


class BoardRow(NamedTuple):
    """A signal of the reports: its label, the factor from SI to its unit, and how its value is written."""

    signal: str
    label: str
    factor: float
    unit: str
    style: str


KNOWN = {
    row.signal: row
    for row in (
        BoardRow("drift", "drift", 1e3, "mm", "+9.3f"),
        BoardRow("column_force", "column force", 1e-3, "kN", "+9.3f"),
        BoardRow("column_force_used", "slave's column", 1e-3, "kN", "+9.3f"),
        BoardRow("damper_force", "damper force", 1.0, "N", "+9.1f"),
        BoardRow("round_trip", "round trip", 1e6, "µs", "9.0f"),
    )
}
BESIDE = ("tick", "t", "missed", "earthquake_time", "rate")  # values of a report that have no row
LABEL = len("column force")  # columns at least


def row_of(name: str) -> BoardRow:
    """The row of a signal; a signal that is not known is the force of a user's kind of laboratory."""
    return KNOWN.get(name, BoardRow(name, name.replace("_", " "), 1.0, "N", "+9.1f"))


class Board:
    """The newest reports of a test as lines of a terminal; `modes` are the laboratories' safety modes."""

    def __init__(self, duration: float) -> None:
        self.modes: dict[str, str] = {}
        self._duration = duration
        self._t = self._late = 0.0
        self._said = reached(0.0, duration, {})
        self._values: dict[str, deque[float]] = {}  # in the order of the reports

    def take(self, data: Mapping[str, Any]) -> None:
        """Take in a report of progress."""
        self._t, self._late = float(data["t"]), float(data.get("missed", self._late))
        self._said = reached(self._t, self._duration, data)
        self._t = float(data.get("earthquake_time", self._t))
        for name, value in data.items():
            if name not in BESIDE and isinstance(value, float | int):
                self._values.setdefault(name, deque(maxlen=KEPT)).append(float(value))

    def lines(self, width: int) -> list[list[Span]]:
        """The board in lines of at most `width` columns."""
        found = [row_of(name) for name in self._values]
        label = max((len(row.label) for row in found), default=LABEL)
        rows = [self._row(row, max(label, LABEL), width) for row in found]
        return [cut(line, width) for line in (self._head(), *rows, self._foot()) if line]

    def _head(self) -> list[Span]:
        filled = round(BAR * min(self._t / self._duration, 1.0))
        return [
            Span(f"{self._said}  "),
            Span(f"late {self._late:.0f}  ", YELLOW if self._late else ""),
            Span("█" * filled, BLUE),
            Span("·" * (BAR - filled)),
        ]

    def _row(self, row: BoardRow, label: int, width: int) -> list[Span]:
        values = [row.factor * value for value in self._values[row.signal]]
        newest = "–".rjust(9) if math.isnan(values[-1]) else format(values[-1], row.style)
        beside = Span(f"{row.label:<{label}} {newest} {row.unit:<2}  ")
        return [beside, Span(sparkline(values[-max(width - len(beside.text), 0) :]), BLUE)]

    def _foot(self) -> list[Span]:
        return [
            span
            for lab, mode in self.modes.items()
            for span in (
                Span(f"{shown(lab)} "),
                Span(shown(mode).replace("_", " "), IN_MODE.get(mode, "")),
                Span("   "),
            )
        ]


def sparkline(values: Sequence[float]) -> str:
    """Values as blocks of growing height between the smallest and the largest, a gap where there is none."""
    known = [value for value in values if math.isfinite(value)]
    low, high = min(known, default=0.0), max(known, default=0.0)
    scale = (len(BLOCKS) - 1) / (high - low) if high > low else 0.0
    return "".join(BLOCKS[round((value - low) * scale)] if math.isfinite(value) else " " for value in values)


def cut(line: Sequence[Span], width: int) -> list[Span]:
    """The first `width` columns of a line."""
    found, left = [], width
    for span in line:
        found.append(Span(span.text[: max(left, 0)], span.colour))
        left -= len(span.text)
    return found


def coloured(line: Sequence[Span]) -> str:
    """A line with its colours, without where the user wants none (NO_COLOR)."""
    plain = bool(os.environ.get("NO_COLOR"))
    return "".join(
        span.text if plain or not span.colour or not span.text else f"\x1b[{span.colour}m{span.text}\x1b[0m"
        for span in line
    ).rstrip()
