from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common import signals
from common.errors import InputError
from common.recording.reader import read
from common.recording.run import Run
from common.recording.writer import Recording
from report.budget.checks import longest_run
from report.budget.figures import Bare, bare_loop, figures, measured
from report.budget.limits import PERCENTILES
from report.budget.verdict import percentiles
from tests.rths.latency_budget import noisy

times = st.floats(0.0, 0.1)


@given(st.lists(st.booleans(), max_size=60))
def test_the_longest_gap_agrees_with_a_naive_count(flags: list[bool]) -> None:
    spans = itertools.combinations(range(len(flags) + 1), 2)
    naive = max((last - first for first, last in spans if all(flags[first:last])), default=0)
    assert longest_run(np.array(flags, dtype=bool)) == naive


@given(st.lists(st.one_of(times, st.just(float("nan"))), min_size=1, max_size=200))
def test_percentiles_cover_only_measured_ticks(values: list[float]) -> None:
    kept = np.array([value for value in values if value == value])  # noqa: PLR0124 - NaN is not itself
    found = figures(noisy.run({"round_trip": values})).exchanges[0]
    if not kept.size:
        assert found.segments == {}
        return
    row = percentiles(found)["round_trip"]
    assert row["n"] == kept.size
    assert row["max"] == kept.max()
    for name, rank in PERCENTILES.items():
        assert row[name] == np.percentile(kept, rank)
        assert np.mean(kept <= row[name] + 1e-15) >= rank / 100.0 - 1.0 / kept.size


@given(st.lists(times, min_size=5, max_size=5), times, times)
def test_the_bare_loops_share_falls_with_lateness(values: list[float], one: float, two: float) -> None:
    *known, most = sorted(values)
    bare = Bare(4000, 3, 2e-3, dict(zip(PERCENTILES, known, strict=True)), most)
    low, high = bare.share_beyond(min(one, two)), bare.share_beyond(max(one, two))
    assert 0.0 <= high <= low <= 1.0
    assert bare.share_beyond(most) == 0.0


def test_the_bare_loops_share_passes_through_its_percentiles_down_to_one_tick_at_the_maximum() -> None:
    bare = Bare(20_000, 0, 2e-3, {"p50": 5e-5, "p90": 1e-4, "p99": 3e-4, "p99.9": 1e-3}, 1.8e-3)
    assert bare.share_beyond(4e-5) == 1.0
    assert bare.share_beyond(3e-4) == pytest.approx(0.01)
    assert 0.001 < bare.share_beyond(5e-4) < 0.01
    assert bare.share_beyond(1.79e-3) == pytest.approx(1 / 20_000, rel=0.1)
    assert bare.longest_gap == 1


def test_ticks_that_passed_during_a_pause_do_not_count_in_the_bare_loops_share() -> None:
    percentiles = {"p50": 5e-5, "p90": 1e-4, "p99": 2e-2, "p99.9": 4e-2}
    bare = Bare(4900, 100, 2e-3, percentiles, 5e-2)
    assert bare.late_share == 0.02
    assert bare.longest_gap == 25
    assert bare.share_beyond(1e-4) == pytest.approx(0.08 / 0.98)
    assert bare.share_beyond(1e-3) < 0.002
    assert bare.share_beyond(2e-3) == 0.0


def test_a_tick_counts_as_undisturbed_if_the_master_woke_in_time_at_both_its_ends() -> None:
    run = noisy.run({"wake_lateness": [1e-4, 1e-4, 5e-3, 1e-4, np.nan, 1e-4], "round_trip": [1e-4] * 6})
    assert figures(run).exchanges[0].calm(2e-3).tolist() == [True, False, False, True, True, True]
    assert figures(noisy.run({"round_trip": [1e-4]})).exchanges[0].calm(2e-3).tolist() == [True]


def test_a_bare_loop_is_read_from_metadata_and_left_out_if_incomplete() -> None:
    record = noisy.bare_loop(noisy.Machine(1, 2500))
    found = bare_loop(record)
    assert found is not None
    assert found.ticks == 2500
    assert bare_loop({}) is None
    for name in record:
        assert bare_loop({key: value for key, value in record.items() if key != name}) is None
        assert bare_loop(record | {name: "nan"}) is None
        assert bare_loop(record | {name: "much"}) is None
    assert bare_loop(record | {"bare_loop.interval": "0.0"}) is None


def test_stolen_time_and_schedulers_are_read_for_each_laboratory() -> None:
    record = {"master.stolen_share": "0.25", "slave.stolen_share": "nan", "slave.scheduler": "fifo 50"}
    found = figures(noisy.run({"round_trip": [1e-3]}, record))
    assert found.stolen == {"master": 0.25}
    assert found.schedulers == {"slave": "fifo 50"}


def test_events_replace_a_missing_metadata_record() -> None:
    run = noisy.run({"round_trip": [1e-3]})
    record = noisy.bare_loop(noisy.Machine(1, 2500))
    bare = {name.removeprefix("bare_loop."): float(value) for name, value in record.items()}
    values = {
        "bare_loop": bare,
        "machine": {"seconds": 5.0, "stolen_share": 0.25},
        "real_time": {"priority": 50.0},
    }
    run.events = [{"lab": "master", "code": code, "values": some} for code, some in values.items()]
    run.events += [{"lab": "slave", "code": "real_time", "values": {"priority": 0.0}}]
    run.events += [{"lab": "slave", "code": code, "values": {}} for code in ("machine", "stop")]
    found = figures(run)
    assert found.bare == bare_loop(record)
    assert found.stolen == {"master": 0.25}
    assert found.schedulers == {"master": "fifo 50", "slave": "other"}


def test_every_slave_has_its_own_exchange() -> None:
    run = noisy.run({"round_trip": [1e-3]}, topic="latency.west")
    noisy.add(run, "latency.east", {"round_trip": [2e-3, 3e-3]})
    found = [(item.name, item.ticks, item.unrecorded) for item in figures(run).exchanges]
    assert found == [("west", 2, 1), ("east", 2, 0)]


def test_a_recording_without_latency_is_refused() -> None:
    run = Run(Path("bench.mcap"))
    with pytest.raises(
        InputError, match=r"bench.mcap holds no latency of any tick: give the recording of a whole test"
    ):
        figures(run)
    run.columns["latency"], run.sequences["latency"] = {"round_trip": np.array([])}, np.array([])
    with pytest.raises(InputError, match=r"a.mcap is of a test without slaves, which has no latency"):
        figures(Run(Path("a.mcap"), roles=()))
    with pytest.raises(InputError, match="holds no latency"):
        figures(run)


def test_gaps_and_a_cut_off_end_are_reported() -> None:
    run = noisy.run({"round_trip": [1e-3, 1e-3, 1e-3]})
    assert figures(run).warnings == []
    run.sequences["latency"], run.finished = np.array([1, 2, 4]), False
    assert figures(run).warnings == [
        "The recording was cut off before its end; its ticks until then are judged.",
        "2 ticks are missing from the recording and are not judged.",
    ]


def test_an_end_before_the_planned_one_is_reported() -> None:
    run = noisy.ticked(noisy.run({"round_trip": [1e-3] * 300}), 300)
    assert figures(run).warnings == []
    run.metadata["summary"]["ticks_expected"] = "1166"
    assert figures(run).warnings == [
        "The recording ends after 300 of 1166 planned ticks; its ticks until then are judged."
    ]


def test_rows_belong_to_their_ticks_whatever_their_order_in_the_file() -> None:
    found = {"round_trip": [3e-3, 1e-3], "deadline_missed": [True, False], "command_sent_ns": [0, 1]}
    run = noisy.ticked(noisy.run(found), 4)
    run.sequences["latency"] = np.array([3, 1])
    item = figures(run).exchanges[0]
    assert (item.ticks, item.unrecorded, item.silent) == (4, 2, False)
    assert np.array_equal(item.segments["round_trip"], [np.nan, 1e-3, np.nan, 3e-3], equal_nan=True)
    assert item.late is not None
    assert item.late.tolist() == [True, False, True, True]
    assert item.missed is not None
    assert item.missed.tolist() == [False, True]


def test_ticks_without_a_row_count_as_late_even_without_flags_in_the_file() -> None:
    item = figures(noisy.ticked(noisy.run({"round_trip": [1e-3] * 3}), 5)).exchanges[0]
    assert item.late is not None
    assert item.late.tolist() == [False] * 3 + [True] * 2


ROWS = (
    signals.SEQ,
    signals.Signal("feedback_one_way", "s", "feedback"),
    signals.Signal("deadline_missed", "", "late", signals.FieldType.FLAG),
)


def old_recording(path: Path, ticks: int, *, close: bool = True) -> Recording:
    recording = Recording(path, "old", 1, {"latency": ROWS})
    for seq in range(ticks):
        values: list[Any] = [seq, float("nan") if seq % 10 == 0 else 1e-4, seq % 10 == 0]
        recording.add("latency", seq, seq, values)
    recording.flush()
    if close:
        recording.close({})
    return recording


def test_a_file_with_fewer_columns_gives_the_figures_of_those(tmp_path: Path) -> None:
    old_recording(tmp_path / "old.mcap", 100)
    found = figures(read(tmp_path / "old.mcap")).exchanges[0]
    assert found.segments.keys() == {"feedback_one_way"}
    assert measured(found.segments["feedback_one_way"]).size == 90
    assert found.late is not None
    assert found.late.sum() == 10
    assert found.missed is None


def test_a_file_that_was_cut_off_is_read_up_to_the_cut(tmp_path: Path) -> None:
    recording = old_recording(tmp_path / "cut.mcap", 100, close=False)
    found = figures(read(tmp_path / "cut.mcap"))
    assert found.exchanges[0].ticks == 100
    assert found.warnings == ["The recording was cut off before its end; its ticks until then are judged."]
    recording.abandon()
