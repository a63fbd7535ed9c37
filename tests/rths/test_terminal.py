"""The display on a terminal while a test runs, and the plain lines that go into a file instead."""

from __future__ import annotations

import io
import math
import re
from typing import Any

import pytest

from report.text.board import BLOCKS, Board, sparkline
from report.text.terminal import RunProgress

REPORT = {
    "t": 5.0,
    "drift": 1e-3,
    "column_force": -2e4,
    "damper_force": 33.3,
    "round_trip": 250e-6,
    "missed": 2.0,
}
STARTED = {**REPORT, "t": 0.0, "round_trip": math.nan, "missed": 0.0}


class Terminal(io.StringIO):
    """A terminal with the functions that the display needs."""

    def isatty(self) -> bool:
        return True

    def screen(self) -> list[str]:
        """The lines that a user sees in the end, without colours."""
        lines, place = [""], 0
        for part in re.split(r"(\x1b\[\d*[A-Za-z]|\n|\r)", self.getvalue()):
            if part == "\n":
                place += 1
                lines += [""] * (place + 1 - len(lines))
            elif part.endswith("A") and part.startswith("\x1b"):
                place -= int(part[2:-1])
            elif part == "\x1b[J":
                lines = [*lines[:place], ""]
            elif not part.startswith("\x1b") and part != "\r":
                lines[place] += part
        return lines[:-1]


@pytest.fixture
def terminal(monkeypatch: Any) -> Terminal:
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("LINES", "24")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    return Terminal()


def test_without_a_terminal_the_display_is_a_plain_line_every_five_seconds() -> None:
    stream = io.StringIO()
    progress = RunProgress(40.0, stream)
    for t in (0.0, 0.2, 4.9, 5.0, 5.2):
        progress.show((STARTED if t == 0.0 else REPORT) | {"t": t})
        progress.mode("master", "running")
    progress.say("master: completed")
    progress.end()
    assert stream.getvalue() == (
        "t   0.00/40 s  drift  +1.000 mm  round trip    – µs  late 0\n"
        "t   5.00/40 s  drift  +1.000 mm  round trip  250 µs  late 2\n"
        "master: completed\n"
    )


def test_on_a_terminal_the_display_stays_in_place_and_lines_appear_above_it(terminal: Terminal) -> None:
    progress = RunProgress(40.0, terminal)
    progress.say("starting")
    for tenth in range(30):
        progress.show({**REPORT, "t": tenth / 5, "drift": 1e-3 * math.sin(tenth)})
    progress.mode("master", "running")
    progress.mode("slave", "emergency_stop")
    progress.say("slave: something")
    progress.show(REPORT)
    progress.end()
    screen = terminal.screen()
    assert screen[:2] == ["starting", "slave: something"]
    assert len(screen) == 2 + 6
    assert screen[2].startswith("t   5.00/40 s  late 2  ███···")
    assert [line.split()[0] for line in screen[3:7]] == ["drift", "column", "damper", "round"]
    assert "-20.000 kN" in screen[4]
    assert "33.3 N" in screen[5]
    assert "250 µs" in screen[6]
    assert set(screen[3].split()[-1]) <= set(BLOCKS)
    assert screen[7] == "master running   slave emergency stop"


@pytest.mark.parametrize("columns", [1, 2, 9, 30, 200])
def test_no_line_is_wider_than_the_terminal(columns: int, terminal: Terminal, monkeypatch: Any) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    progress = RunProgress(40.0, terminal)
    for tenth in range(300):
        progress.show({**REPORT, "t": tenth / 5})
    progress.mode("master", "running")
    assert all(len(line) < max(columns, 2) for line in terminal.screen())
    if columns == 200:
        assert any(len(line) > 150 for line in terminal.screen())


def test_a_low_terminal_shows_the_lines_that_fit(terminal: Terminal, monkeypatch: Any) -> None:
    monkeypatch.setenv("LINES", "3")
    progress = RunProgress(40.0, terminal)
    for _ in range(3):
        progress.show(REPORT)
    assert len(terminal.screen()) == 2


@pytest.mark.parametrize(("value", "colours"), [("", True), ("1", False)])
def test_the_variable_no_color_is_respected(
    value: str, colours: bool, terminal: Terminal, monkeypatch: Any
) -> None:
    monkeypatch.setenv("NO_COLOR", value)
    progress = RunProgress(40.0, terminal)
    progress.show(REPORT)
    progress.mode("slave", "safe")
    assert ("\x1b[31msafe\x1b[0m" in terminal.getvalue()) is colours
    assert bool(re.search(r"\x1b\[\d*m", terminal.getvalue())) is colours


def test_a_dumb_terminal_gets_plain_lines(terminal: Terminal, monkeypatch: Any) -> None:
    monkeypatch.setenv("TERM", "dumb")
    RunProgress(40.0, terminal).show(REPORT)
    assert "\x1b" not in terminal.getvalue()


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([], ""),
        ([0.0], "▁"),
        ([math.nan], " "),
        ([3.0, 3.0], "▁▁"),
        ([0.0, 1.0, math.nan, 0.5, math.inf], "▁█ ▅ "),
        ([-1.0, 1.0], "▁█"),
    ],
)
def test_a_sparkline_spans_from_the_smallest_to_the_largest_value(values: list[float], expected: str) -> None:
    assert sparkline(values) == expected


def test_a_signal_that_is_missing_in_the_report_has_no_line() -> None:
    board = Board(1.0)
    board.take({"t": 0.5})
    assert len(board.lines(80)) == 1
