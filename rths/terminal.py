"""What commands write on the terminal: tables, and the progress of a test."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any, TextIO

BAR = 24
LINE_EVERY = 5.0  # s of test, where there is no terminal


def table(rows: Sequence[Sequence[str]], stream: TextIO | None = None) -> None:
    """Write rows in aligned columns, the first column to the left, the others to the right."""
    widths = [max(len(row[place]) for row in rows) for place in range(len(rows[0]))]
    for row in rows:
        cells = [
            row[0].ljust(widths[0]),
            *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)),
        ]
        (stream or sys.stdout).write("  ".join(cells).rstrip() + "\n")


class Progress:
    """Progress of a test on standard error: a bar on a terminal, plain lines now and then elsewhere."""

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self._stream = sys.stderr
        self._live = sys.stderr.isatty()
        self._next = 0.0
        self._open = False

    def show(self, data: Mapping[str, Any]) -> None:
        """Show one report of progress."""
        t = float(data["t"])
        if not self._live and t < self._next:
            return
        self._next = t + LINE_EVERY
        facts = f"t {t:6.2f}/{self._duration:g} s"
        if "drift" in data:
            facts += f"  drift {data['drift'] * 1e3:+7.3f} mm"
        if "round_trip" in data:
            facts += f"  round trip {microseconds(data['round_trip'])} µs  late {data['missed']:.0f}"
        if self._live:
            filled = round(BAR * min(t / self._duration, 1.0))
            self._stream.write(f"\r[{'█' * filled}{'·' * (BAR - filled)}] {facts} ")
            self._open = True
        else:
            self._stream.write(facts + "\n")
        self._stream.flush()

    def say(self, text: str) -> None:
        """A line of its own, beside the bar."""
        self.end()
        self._stream.write(text + "\n")
        self._stream.flush()

    def end(self) -> None:
        """Leave the bar's line."""
        if self._open:
            self._stream.write("\n")
            self._open = False


def microseconds(seconds: float) -> str:
    """A time in µs, a dash where it is not known yet."""
    return "   –" if seconds != seconds else f"{seconds * 1e6:4.0f}"  # noqa: PLR0124 - NaN is not itself


def quantity(value: float, unit: str) -> str:
    """A value with its unit, in the size a reader of the field expects."""
    factors = {"m": (1e3, "mm"), "N": (1e-3, "kN"), "s": (1e6, "µs")}
    if unit == "N" and abs(value) < 1e3:
        return f"{value:.1f} N"
    factor, name = factors.get(unit, (1.0, unit))
    return f"{value * factor:.3f} {name}"
