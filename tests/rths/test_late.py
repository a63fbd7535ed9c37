"""The sentences about a recording's late ticks, in its summary and its verdict."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.recording.reader import read
from common.recording.run import Run
from report.facts import late
from report.facts.summary import summarize
from report.run import verdict
from rths.examine import inspect


def with_late(path: Path, *spans: tuple[int, int]) -> Run:
    """A recording in which some ticks came late."""
    run = read(path)
    latency = dict(run.columns["latency"])
    missed = np.zeros(len(latency["seq"]), dtype=bool)
    woke = np.full(len(missed), 20e-6)  # s; it is 0 on a virtual clock only
    for begin, end in spans:
        missed[begin:end] = True
    return replace(
        run, columns=run.columns | {"latency": latency | {"deadline_missed": missed, "wake_lateness": woke}}
    )


def test_a_run_that_missed_real_time_states_this_first(virtual_recording: Path, capsys: Any) -> None:
    run = with_late(virtual_recording, (0, 1800))
    summary = summarize(run)
    assert summary["real_time"] == {"late": 1800, "ticks": 2000, "worst": 1000, "window": 1000}
    inspect.write_report(summary)
    assert (
        capsys.readouterr()
        .out.splitlines()[2]
        .startswith(
            "WARNING: The test did not keep real time: 1800 of 2000 ticks (90%) were late, up to 1000 of 1000 in a row"
        )
    )
    assert verdict.sentences(run, summary)[1] == summary["warnings"][0]


@pytest.mark.parametrize("spans", [[], [(100, 150)], [(0, 25), (1200, 1225)]])
def test_single_pauses_are_counted_without_a_warning(
    spans: list[tuple[int, int]], virtual_recording: Path
) -> None:
    summary = summarize(with_late(virtual_recording, *spans))
    assert summary["real_time"]["late"] == sum(end - begin for begin, end in spans)
    assert summary["warnings"] == []


def test_in_virtual_time_delayed_messages_do_not_count_as_late_ticks(virtual_recording: Path) -> None:
    run = read(virtual_recording)
    run.columns["latency"]["deadline_missed"] = np.ones(len(run.columns["latency"]["seq"]), dtype=bool)
    summary = summarize(run)
    assert summary["real_time"] is None
    assert summary["warnings"] == []


def test_without_recorded_latency_late_ticks_are_not_mentioned(virtual_recording: Path) -> None:
    run = read(virtual_recording)
    columns = {topic: values for topic, values in run.columns.items() if topic != "latency"}
    assert late.late_ticks(replace(run, columns=columns)) is None
    assert late.warning(None) == ""


@pytest.mark.parametrize("topic", ["master", "slave", "latency"])
def test_a_recording_that_lacks_any_one_signal_is_inspected(topic: str, virtual_recording: Path) -> None:
    whole = read(virtual_recording)
    for name in whole.columns[topic]:
        fewer = {key: values for key, values in whole.columns[topic].items() if key != name}
        run = replace(whole, columns=whole.columns | {topic: fewer})
        summary = summarize(run)
        inspect.write_report(summary)
        assert verdict.sentences(run, summary)
        if topic == "latency":
            assert (summary["missed_ticks"] is None) == (name in ("seq", "command_sent_ns"))
            assert (summary["late_ticks"] is None) == (name in ("seq", "deadline_missed"))


def test_with_a_client_late_ticks_are_counted_by_cause(virtual_recording: Path, capsys: Any) -> None:
    run = read(virtual_recording)
    ticks = len(run.columns["master"]["t"])
    woke, late = np.full(ticks, 80e-6), np.zeros(ticks, dtype=bool)
    woke[100:104], late[10:12] = 2.1e-3, True
    of = run.columns["master"] | {"client_late": late, "wake_lateness": woke}
    columns = {topic: values for topic, values in run.columns.items() if topic != "latency"}
    summary = summarize(replace(run, columns=columns | {"master": of}))
    assert summary["beside_client"] == {"ticks": 2000, "client_late": 2, "woke_late": 4}
    inspect.write_report(summary)
    said = "Of 2000 ticks 2 (0.10%) had no displacement of the client in time, and 4 (0.20%) began late by an interval"
    assert said in capsys.readouterr().out
    assert said in verdict.lateness(run, summary)
    assert summarize(run)["beside_client"] is None
