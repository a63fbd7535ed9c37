"""The lines of a test's process on standard error while it waits, runs and ends."""

from __future__ import annotations

import math
from typing import Any

import pytest

from common.errors import LostError
from common.host.waited import SAY_NS, Waited
from common.lab import process
from common.recording.outcome import outcome
from common.terminal import cli
from common.terminal.plain_report import PlainReport, reached


def test_progress_is_printed_periodically_with_a_dash_for_missing_numbers(capsys: Any) -> None:
    report = PlainReport(40.0)
    for tick in range(0, 3_500, 100):
        data = {
            "t": tick * 0.002,
            "drift": 1e-3,
            "round_trip": math.nan if tick == 0 else 3e-4,
            "missed": 2.0,
        }
        report("progress", {"tick": tick, **data})
    assert capsys.readouterr().err.splitlines() == [
        "t   0.00/40 s  drift  +1.000 mm  round trip    – µs  late 2",
        "t   5.00/40 s  drift  +1.000 mm  round trip  300 µs  late 2",
    ]


@pytest.mark.parametrize(
    ("data", "text"),
    [
        ({}, "t   6.20/8 s"),
        ({"earthquake_time": 4.336, "rate": 0.5}, "t   6.20 s, earthquake 4.34/8 s"),
        ({"earthquake_time": 4.336, "rate": 0.0}, "t   6.20 s, earthquake 4.34/8 s, held"),
    ],
)
def test_progress_is_said_in_the_earthquakes_time_once_the_test_was_held(
    data: dict[str, float], text: str
) -> None:
    assert reached(6.2, 8.0, data) == text


def test_an_error_is_printed_once(capsys: Any) -> None:
    report = PlainReport(40.0)

    def main() -> int:
        report("event", {"lab": "master", "level": "error", "code": "nobody", "text": "No slave joined."})
        raise process.last_word(LostError("No slave joined."), report)

    assert cli.guarded(main) == 4
    assert capsys.readouterr().err == "rths: No slave joined.\n"
    with pytest.raises(LostError) as raised:
        raise process.last_word(LostError("another"), report)
    assert not raised.value.said


def test_the_awaited_peer_is_named_periodically() -> None:
    waited = Waited(0)
    said = [waited.news("slave and recorder", 30.0, second * 10**9) for second in range(26)]
    assert [text for text in said if text] == [
        "still waits for slave and recorder: 10 of 30 s have passed.",
        "still waits for slave and recorder: 20 of 30 s have passed.",
    ]
    assert waited.news("", 30.0, 100 * SAY_NS) == ""
    assert waited.news("slave", 30.0, 100 * SAY_NS + 1) == ""


def test_an_outcome_is_shown_as_one_word_or_cut_off() -> None:
    assert outcome({"outcome": "stop", "cause": "completed"}) == "completed"
    assert outcome({"outcome": "limit"}) == "limit"
    assert outcome({}) == "cut off"
