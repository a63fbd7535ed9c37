"""Progress on standard error: silent at first, one line on a terminal, few lines elsewhere, gone when work ends."""

from __future__ import annotations

import io

import pytest

from report.text.progress import Progress


@pytest.fixture(autouse=True)
def unhurried() -> None:
    """These tests need progress, which is switched off elsewhere."""


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_work_that_ends_within_two_seconds_shows_no_progress() -> None:
    stream = io.StringIO()
    progress = Progress("working", stream, began=0.0)
    for now in (0.0, 1.0, 1.99):
        progress.look(now)
    assert stream.getvalue() == ""


def test_without_a_terminal_progress_is_a_line_every_five_seconds_and_only_after_a_change() -> None:
    stream = io.StringIO()
    progress = Progress("working", stream, began=0.0)
    for now in range(40):
        progress.tell("steps", min(now, 20), 20)
        progress.look(float(now))
    assert stream.getvalue().splitlines() == [
        "working: steps, 2 of 20, 2 s",
        "working: steps, 7 of 20, 7 s",
        "working: steps, 12 of 20, 12 s",
        "working: steps, 17 of 20, 17 s",
        "working: steps, 20 of 20, 22 s",
    ]


def test_on_a_terminal_one_line_is_rewritten_within_its_width_and_wiped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    stream = Terminal()
    progress = Progress("working", stream, began=0.0)
    progress.tell("steps", 1, 2)
    progress.look(3.0)
    progress.tell("a stage with a name much longer than the line is wide")
    progress.look(4.0)
    progress.tell("end")
    progress.look(5.0)
    progress.leave(wipe=True)
    assert "\n" not in stream.getvalue()
    assert "\x1b" not in stream.getvalue()
    lines = stream.getvalue().split("\r")[1:]
    assert lines[0] == f"[{'█' * 12}{'·' * 12}] working: ste"
    assert lines[2] == "working: end, 5 s".ljust(39)
    assert all(len(line) <= 39 for line in lines)
    assert lines[-2:] == [" " * 17, ""]


def test_an_error_keeps_the_progress_line_and_starts_a_new_one() -> None:
    stream = Terminal()

    def work() -> None:
        with Progress("working", stream, began=-10.0) as progress:
            progress.look(0.0)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work()
    assert stream.getvalue() == "\rworking: 10 s\n"


def test_a_closed_standard_error_does_not_end_the_work() -> None:
    stream = Terminal()
    with Progress("working", stream, began=-10.0) as progress:
        progress.look(0.0)
        stream.close()
        progress.tell("more")
    assert stream.closed
