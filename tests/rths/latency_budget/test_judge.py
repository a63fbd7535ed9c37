from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import InputError
from common.recording.run import Run
from report.budget.checks import BudgetCheck
from report.budget.figures import figures
from report.budget.judge import judge
from report.budget.limits import from_tables, load
from report.budget.text import text
from report.budget.verdict import BudgetReport
from tests.rths.latency_budget import noisy

QUIET = {
    "p50": 5e-5,
    "p90": 7e-5,
    "p99": 1e-4,
    "p99.9": 2e-4,
    "max": 3e-4,
    "interval": 2e-3,
    "ticks": 5e3,
    "late": 0.0,
}


def record(**changed: float) -> dict[str, str]:
    """A bare loop's record; `p99_9` stands for "p99.9"."""
    values = QUIET | {name.replace("_9", ".9"): value for name, value in changed.items()}
    return {f"bare_loop.{name}": repr(value) for name, value in values.items()}


def verdict(run: Run, tables: dict[str, Any] | None = None) -> BudgetReport:
    return judge(figures(run), load(None) if tables is None else from_tables(tables))


def check(report: BudgetReport, name: str) -> BudgetCheck:
    return next(item for item in report.checks if item.name == name)


@pytest.mark.parametrize("ticks", [2500, 20_000])
@pytest.mark.parametrize("scheduler", list(noisy.SPIKES))
def test_clean_recordings_are_judged_within_and_delayed_ones_over_in_ten_of_ten_draws(
    ticks: int, scheduler: str
) -> None:
    clean = [verdict(noisy.clean(seed, ticks, scheduler)).status for seed in range(10)]
    delayed = [verdict(noisy.delayed(seed, ticks, scheduler)) for seed in range(10)]
    assert clean == ["within"] * 10
    assert [report.status for report in delayed] == ["over"] * 10
    assert all(check(report, "feedback_one_way p99").verdict == "over" for report in delayed)


@pytest.mark.parametrize("name", ["command_one_way", "slave_time"])
def test_a_delay_of_the_command_or_in_the_slave_is_detected(name: str) -> None:
    for seed in range(10):
        run = noisy.clean(seed, 2500)
        run.columns["latency"][name][::50] += 1e-3
        assert check(verdict(run), f"{name} p99").verdict == "over"


def test_without_a_bare_loop_the_limits_are_used_unchanged() -> None:
    run = noisy.delayed(1, 2500)
    run.metadata = {}
    report = verdict(run)
    assert report.status == "over"
    assert all(item.bare is None and item.allowed == item.limit for item in report.checks)
    assert (
        "No bare loop was recorded, so a slow machine cannot be distinguished from a slow test."
        in report.warnings
    )


def test_the_bare_loop_raises_a_limit_once_per_wait_and_not_beyond_a_bound() -> None:
    names = {"slave_time": 1e-3, "feedback_one_way": 1e-3, "round_trip": 1e-3}
    tables = {name: {"p99": limit} for name, limit in names.items()}
    run = noisy.run({name: [1e-4] * 600 for name in names}, record(p99=0.04e-3))
    allowed = [item.allowed for item in verdict(run, tables).checks]
    assert allowed == pytest.approx([1.04e-3, 1.08e-3, 1.2e-3])
    run.metadata["real_time"] = record(p99=0.2e-3, p99_9=1e-3, max=2e-3)
    allowed = [item.allowed for item in verdict(run, tables).checks]
    assert allowed == pytest.approx([1.2e-3, 1.3e-3, 1.3e-3])
    assert {item.bare for item in verdict(run, tables).checks} == {0.2e-3}


def late_in(share: float, value: float, ticks: int = 10_000) -> dict[str, Any]:
    values = np.full(ticks, 1e-4)
    values[: round(share * ticks)] = value
    return {"feedback_one_way": values}


NOISE = record(
    p99=1.5e-3, p99_9=3e-3, max=9e-3
)  # about 1 % of the bare loop's ticks as late as what is judged here
TAIL = {"feedback_one_way": {"p99": 0.6e-3}}


def test_a_delay_that_the_bare_loop_also_had_is_not_judged() -> None:
    report = verdict(noisy.run(late_in(0.015, 1.5e-3), NOISE), TAIL)
    assert (report.status, report.exit_code) == ("not_judged", 0)
    assert check(report, "feedback_one_way p99").verdict == "doubt"


def test_a_delay_that_the_bare_loop_did_not_have_is_over() -> None:
    assert verdict(noisy.run(late_in(0.015, 1.5e-3), record()), TAIL).status == "over"
    assert verdict(noisy.run(late_in(0.08, 1.5e-3), NOISE), TAIL).status == "over"


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"slave.stolen_share": "0.08"}, "The host took 8.0 % of the processors' time of the slave"),
        (record(late=150.0), "The bare loop itself was late in 2.91 % of its ticks: beyond 2.00 % nothing"),
    ],
)
def test_on_an_unfit_machine_a_value_over_its_limit_is_not_judged(
    changed: dict[str, str], reason: str
) -> None:
    slow = verdict(noisy.run(late_in(0.08, 1.5e-3), record() | changed), TAIL)
    assert slow.status == "not_judged"
    assert slow.doubts[0].startswith(reason)
    assert reason in text(slow)
    assert verdict(noisy.run(late_in(0.0, 0.0), record() | changed), TAIL).status == "within"


def test_on_an_unsteady_machine_messages_are_judged_and_late_ticks_are_not() -> None:
    unsteady = record(late=50.0)
    late = verdict(noisy.run(flags(100), unsteady), {"late": {"share": 0.01, "longest_gap": 2}})
    assert late.status == "not_judged"
    assert "beyond 0.50 % late ticks and wake_lateness over their limits are not judged" in late.doubts[0]
    assert verdict(noisy.run(late_in(0.08, 1.5e-3), unsteady), TAIL).status == "over"


def test_a_message_that_waits_for_a_paused_process_does_not_count_as_slow() -> None:
    found = late_in(0.03, 20e-3) | {"wake_lateness": np.full(10_000, 5e-5)}
    assert verdict(noisy.run(found, record()), TAIL).status == "over"
    found["wake_lateness"][:301] = 20e-3
    assert verdict(noisy.run(found, record()), TAIL).status == "not_judged"
    found["wake_lateness"] *= 0.05  # woken within the interval: no standstill
    assert verdict(noisy.run(found, record()), TAIL).status == "over"


def flags(late: int, ticks: int = 1000) -> dict[str, Any]:
    return {
        "deadline_missed": np.arange(ticks) < late,
        "command_sent_ns": np.where(np.arange(ticks) < late // 2, 0, 1),
    }


def test_late_and_missed_ticks_are_counted() -> None:
    tables = {"late": {"share": 0.01, "missed_share": 0.01, "longest_gap": 30}}
    report = verdict(noisy.run(flags(30)), tables)
    assert {item.name: item.verdict for item in report.checks} == {
        "late share": "over",
        "missed share": "over",
        "longest gap": "ok",
    }
    assert report.plain()["late"] == {
        "ticks": 1000,
        "late": 30,
        "share": 0.03,
        "longest_gap": 30,
        "missed": 15,
        "missed_share": 0.015,
    }
    assert verdict(noisy.run(flags(10)), tables).status == "within"
    assert check(verdict(noisy.run(flags(31)), tables), "longest gap").verdict == "over"


def test_a_pause_of_the_machine_does_not_count_as_a_gap_of_the_test() -> None:
    run = noisy.run(flags(40), record(max=0.021))
    stalled = check(verdict(run, {"late": {"longest_gap": 30}}), "longest gap")
    assert (stalled.bare, stalled.allowed, stalled.verdict) == (11, 41.0, "ok")


def test_a_budget_may_allow_no_late_tick() -> None:
    assert verdict(noisy.run(flags(1)), {"late": {"share": 0}}).status == "over"
    assert verdict(noisy.run(flags(0)), {"late": {"share": 0}}).status == "within"


def test_a_percentile_next_to_the_maximum_is_not_judged() -> None:
    tables = {"feedback_one_way": {"p99": 1e-5, "p50": 1.0}}
    report = verdict(noisy.run(late_in(0.0, 0.0, 499)), tables)
    assert report.status == "within"
    assert check(report, "feedback_one_way p99").verdict == "short"
    assert report.warnings == ["Too few ticks for feedback_one_way p99: fewer than 5 values lie beyond."]
    assert verdict(noisy.run(late_in(0.0, 0.0, 500)), tables).status == "over"
    only = {"feedback_one_way": {"p99": 1e-5}}
    assert verdict(noisy.run(late_in(0.0, 0.0, 499)), only).status == "not_judged"


def test_the_largest_value_alone_is_not_judged() -> None:
    run = noisy.clean(1, 2500, "fifo")
    run.columns["latency"]["round_trip"][7] = 10.0
    assert verdict(run).status == "within"


def test_absent_figures_are_reported_and_the_others_judged() -> None:
    run = noisy.run(late_in(0.08, 1.5e-3))
    report = verdict(run)
    assert report.status == "over"
    assert "The recording has no value of wake_lateness, compute_time, command_one_way" in report.warnings[0]
    assert "late ticks, missed ticks: not judged." in report.warnings[0]
    with pytest.raises(
        InputError, match=r"made_up.mcap has no value of anything that the budget .* limits: round_trip."
    ):
        verdict(run, {"round_trip": {"p99": 1e-3}})


def test_each_of_several_slaves_is_judged() -> None:
    machine = noisy.Machine(1, 2500)
    run = noisy.run(noisy.columns(machine), noisy.bare_loop(machine), "latency.west")
    assert verdict(run).status == "within"
    noisy.add(run, "latency.east", noisy.delayed(2, 2500).columns["latency"])
    report = verdict(run)
    assert report.status == "over"
    assert check(report, "east/feedback_one_way p99").verdict == "over"
    assert check(report, "west/feedback_one_way p99").verdict == "ok"
    assert {"west/round_trip", "east/round_trip"} <= report.plain()["segments"].keys()
    assert {"west/late", "east/late"} <= report.plain()["late"].keys()


def two_slaves(ticks: int = 1166) -> Run:
    """A clean recording with two slaves."""
    machine = noisy.Machine(1, ticks, "fifo")
    run = noisy.run(noisy.columns(machine), noisy.bare_loop(machine), "latency.roof")
    noisy.add(run, "latency.middle", noisy.columns(machine))
    return noisy.ticked(run, ticks)


def test_a_slave_without_any_row_is_over_any_budget() -> None:
    run = two_slaves()
    assert verdict(run).status == "within"
    noisy.keep(run, "latency.middle", slice(0, 0))
    report = verdict(run)
    assert report.status == "over"
    assert {item.name for item in report.checks if item.verdict == "over"} == {
        "middle/late share",
        "middle/longest gap",
        "middle/ticks without latency",
    }
    assert report.plain()["late"]["middle/longest_gap"] == 1166
    assert "over the budget: middle/late share" in text(report)
    assert report.warnings == [
        "The recording has no latency of any of the 1166 ticks with middle, which is over any budget."
    ]
    assert verdict(run, {"round_trip": {"p99": 1.0}}).status == "over"
    run.metadata["real_time"]["master.stolen_share"] = "0.5"
    assert verdict(run).status == "over"
    del run.columns["latency.middle"], run.sequences["latency.middle"]
    assert verdict(run).status == "over"
    json.dumps(verdict(run).plain(), allow_nan=False)


@pytest.mark.parametrize("rows", [slice(300), slice(866, None), slice(None, None, 2), slice(100, 1100)])
def test_ticks_without_a_row_count_as_late(rows: slice) -> None:
    report = verdict(noisy.keep(two_slaves(), "latency.middle", rows))
    missing = 1166 - len(range(1166)[rows])
    assert report.status == "over"
    assert report.plain()["ticks"] == 1166
    assert report.plain()["late"]["middle/late"] >= missing
    assert check(report, "middle/late share").verdict == "over"
    assert check(report, "roof/late share").verdict == "ok"
    assert (
        report.warnings[0] == f"{missing} of 1166 ticks with middle have no row of latency and count as late."
    )


def test_a_lost_end_extends_the_gap_of_the_last_late_ticks() -> None:
    run = noisy.ticked(noisy.run(flags(0, 100)), 100)
    run.columns["latency"]["deadline_missed"][78:80] = True
    report = verdict(noisy.keep(run, "latency", slice(80)), {"late": {"longest_gap": 21}})
    assert (report.status, check(report, "longest gap").value) == ("over", 22.0)


@pytest.mark.parametrize(("lost", "status"), [(0, "within"), (499, "within"), (500, "within"), (700, "over")])
def test_in_a_recording_that_was_cut_off_rows_of_the_last_second_may_be_missing(
    lost: int, status: str
) -> None:
    run = noisy.keep(two_slaves(), "latency.middle", slice(1166 - lost))
    run.finished = False
    run.metadata.pop("summary")
    report = verdict(run)
    assert report.status == status
    assert report.warnings[0] == "The recording was cut off before its end; its ticks until then are judged."
    assert any("count as late" in sentence for sentence in report.warnings) == (status == "over")
    late = {"middle/ticks": 1166 - lost if lost <= 500 else 666, "roof/ticks": 1166}
    assert late.items() <= report.plain()["late"].items()
    assert verdict(noisy.keep(run, "latency.middle", slice(0, 0))).status == "over"


@pytest.mark.parametrize(
    "run", [noisy.clean(3, 2500), noisy.delayed(3, 2500), noisy.run(flags(1) | late_in(0.1, 1, 1000))]
)
def test_a_report_is_strict_json(run: Run) -> None:
    plain = json.loads(json.dumps(verdict(run).plain(), allow_nan=False))
    assert plain.keys() == {
        *(
            "status",
            "recording",
            "budget",
            "ticks",
            "segments",
            "late",
            "bare_loop",
            "machine",
            "checks",
            "warnings",
        ),
    }
    assert plain["segments"]["feedback_one_way"].keys() == {"p50", "p90", "p99", "p99.9", "max", "n"}
    assert (plain["bare_loop"] or {}).keys() <= {*QUIET, "late_share"}
    assert all(item["ok"] == (item["verdict"] == "ok") for item in plain["checks"])
    assert plain["status"] == ("within" if all(item["ok"] for item in plain["checks"]) else "over")


def test_the_table_names_the_figures_over_their_limits_and_the_bare_loop() -> None:
    said = text(verdict(noisy.delayed(1, 2500)))
    assert "over the budget: feedback_one_way p99" in said.splitlines()[-1]
    assert any(line.startswith("bare loop ") for line in said.splitlines())
    assert "; bare loop: " in said


@given(st.floats(0.0, 5e-3), st.floats(0.0, 5e-3), st.sampled_from(["p50", "p90", "p99"]))
def test_a_steady_delay_is_never_attributed_to_the_machine(value: float, limit: float, name: str) -> None:
    run = noisy.run({"feedback_one_way": np.full(1000, value)}, record())
    report = verdict(run, {"feedback_one_way": {name: limit}})
    assert report.status == ("within" if value <= limit + min(2 * QUIET[name], 0.3e-3) + 1e-9 else "over")


@given(st.integers(0, 40), st.floats(1e-4, 3e-3))
def test_a_longer_tail_never_gives_a_better_verdict(late: int, value: float) -> None:
    order = ["within", "not_judged", "over"]
    shares = [late / 1000.0, (late + 1) / 1000.0]
    ranks = [order.index(verdict(noisy.run(late_in(share, value), NOISE), TAIL).status) for share in shares]
    assert ranks == sorted(ranks)
