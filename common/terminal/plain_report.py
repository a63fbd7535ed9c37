"""What a process of a test says on standard error: each thing once, in plain lines."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Mapping
from typing import Any

from common.terminal.printable import shown

LINE_EVERY = 5.0  # s of test from one line of progress to the next, where there is no terminal to draw on


class PlainReport:
    """Lines of one process; `duration` is that of the test, s.

    The error that ends a laboratory's test is said when it happens, with the mark of a command's last word, because
    the ramp to rest and a reset may take long: whoever passes it on afterwards does not repeat it.
    """

    def __init__(self, duration: float) -> None:
        self.errors: set[str] = set()  # what was said of them
        self._duration = duration
        self._next = 0.0

    def __call__(self, kind: str, data: Mapping[str, Any]) -> None:
        """Say one report, where it is for the user."""
        if kind == "progress":
            self._progress(data)
            return
        if kind == "event" and data["level"] == "error":
            self.errors.add(str(data["text"]))
            say(f"rths: {data['text']}")
        elif line := plain(kind, data):
            say(line)

    def _progress(self, data: Mapping[str, Any]) -> None:
        if float(data["t"]) >= self._next:
            self._next = float(data["t"]) + LINE_EVERY
            say(facts(data, self._duration))


def say(line: str) -> None:
    """Write a line, as long as anybody reads it: a closed terminal ends no test."""
    with contextlib.suppress(OSError):
        sys.stderr.write(shown(line) + "\n")
        sys.stderr.flush()


def plain(kind: str, data: Mapping[str, Any]) -> str:
    """A report as a line, empty where it is for programs only."""
    match kind:
        case "state":
            return f"{data['lab']}: {data['state']}"
        case "event" | "waiting" | "resting":
            return f"{data['lab']}: {data['text']}"
        case _:
            return ""


def facts(data: Mapping[str, Any], duration: float) -> str:
    """A report of progress as one line."""
    text = f"t {data['t']:6.2f}/{duration:g} s"
    if "drift" in data:
        text += f"  drift {data['drift'] * 1e3:+7.3f} mm"
    if "round_trip" in data:
        text += f"  round trip {microseconds(data['round_trip'])} µs  late {data['missed']:.0f}"
    return text


def microseconds(seconds: float) -> str:
    """A time in µs, a dash where it is not known yet."""
    return "   –" if seconds != seconds else f"{seconds * 1e6:4.0f}"  # noqa: PLR0124 - NaN is not itself
