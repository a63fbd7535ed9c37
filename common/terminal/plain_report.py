"""The report of a process on standard error in plain lines, each error once."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Mapping
from typing import Any

from common.terminal.printable import shown

LINE_EVERY = (
    5.0  # s of test between two lines of progress, where there is no terminal: eight for the default test
)


class PlainReport:
    """The lines of one process; `duration` is that of the test, s.

    The error that ends a laboratory's test is printed when it happens, in the form of a command's error, because the
    ramp to rest and a reset may take long. `errors` holds it, so that the command does not print it again at its end.
    """

    def __init__(self, duration: float) -> None:
        self.errors: set[str] = set()  # texts of the errors printed
        self._duration = duration
        self._next = 0.0

    def __call__(self, kind: str, data: Mapping[str, Any]) -> None:
        """Print one report, if it is for the user."""
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
    """Print a line; a closed terminal is ignored, since it must not end a test."""
    with contextlib.suppress(OSError):
        sys.stderr.write(shown(line) + "\n")
        sys.stderr.flush()


def plain(kind: str, data: Mapping[str, Any]) -> str:
    """A report as a line, an empty text where it is for programs only."""
    match kind:
        case "state":
            return f"{data['lab']}: {data['state']}"
        case "event" | "waiting" | "resting":
            return f"{data['lab']}: {data['text']}"
        case _:
            return ""


def facts(data: Mapping[str, Any], duration: float) -> str:
    """A report of progress as one line."""
    text = reached(float(data["t"]), duration, data)
    if "drift" in data:
        text += f"  drift {data['drift'] * 1e3:+7.3f} mm"
    if "round_trip" in data:
        text += f"  round trip {microseconds(data['round_trip'])} µs  late {data['missed']:.0f}"
    return text


def reached(t: float, duration: float, data: Mapping[str, Any]) -> str:
    """How far a test is at a time t (s); after a hold also in the earthquake's time, which ends at `duration`."""
    if "earthquake_time" not in data:
        return f"t {t:6.2f}/{duration:g} s"
    still = ", held" if data["rate"] == 0.0 else ""
    return f"t {t:6.2f} s, earthquake {data['earthquake_time']:.2f}/{duration:g} s{still}"


def microseconds(seconds: float) -> str:
    """A time in µs, a dash where it is not known yet."""
    return "   –" if seconds != seconds else f"{seconds * 1e6:4.0f}"  # noqa: PLR0124 - NaN is not itself
