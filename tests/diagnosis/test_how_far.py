"""How far the gap closes when the right effect is added, judged on data that were not used for fitting."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from common.recording.reader import read
from common.roles import MASTER
from diagnosis.diagnose import examine
from diagnosis.findings import gaps, how_far, report, where
from diagnosis.findings.certainty import trust
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.sites.shares import shares
from diagnosis.findings.where import SiteTrace
from diagnosis.recorded import record
from diagnosis.recorded.loop import closed_share, overall
from rths.examine.diagnose import diagnose_file
from tests.diagnosis.cases import SECONDS, STRONGEST, Cases, Effects, imported

FOUND: dict[str, Effects] = {
    "column": {"column.friction": {"force": 900.0}},
    "damper": {"damper.friction": {"force": 3.0}},
    "table": {"table.gain": {"factor": 0.93}},
    "two": {"column.friction": {"force": 900.0}, "damper.friction": {"force": 3.0}},
}


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Cases:
    """Recordings with known secrets, made on demand, no longer than the strongest motion."""
    return Cases(tmp_path_factory, STRONGEST)


@pytest.mark.long
@pytest.mark.parametrize("kind", FOUND)
def test_the_right_effect_closes_the_gap_down_to_the_noise(cases: Cases, kind: str) -> None:
    far = cases.report(FOUND[kind])["how_far"]
    assert far["before"] > 1.3 * far["after"]
    assert far["closed"] > 0.9
    assert far["after"] == pytest.approx(far["noise_floor"], rel=0.15)
    assert far["closed_interval"][0] <= far["closed"] <= far["closed_interval"][1]
    assert far["closed"] == pytest.approx(
        (far["before"] - far["after"]) / (far["before"] - far["noise_floor"]), rel=1e-6
    )
    assert far["judged_on"] == "interleaved (interpolation)"


def test_a_reading_that_stood_still_over_a_stretch_leaves_the_interval_finite() -> None:
    motion = np.sin(0.1 * np.arange(6000))
    force = np.where(np.arange(6000) < 3000, 0.0, motion)  # steps that are coarser than the motion
    signals = {"motion": motion, "force": force}
    record = SimpleNamespace(
        plan=SimpleNamespace(test=SimpleNamespace(interval=0.002)),
        ticks=6000,
        signals=signals,
        present={name: np.ones(6000, dtype=bool) for name in signals},
    )
    own = SimpleNamespace(
        record=record, mask=np.ones(6000, dtype=bool), gap=lambda _: dict.fromkeys(signals, 1.0)
    )
    before, after = (dict.fromkeys(signals, share * motion) for share in (0.5, 0.9))
    low, high = how_far.closed_interval(own, before, after, 0.0)  # type: ignore[arg-type]
    assert low <= high
    assert np.isfinite([low, high]).all()


def test_the_waterfall_decreases_site_by_site(cases: Cases) -> None:
    report = cases.report(FOUND["two"])
    steps = report["details"]["waterfall"]
    assert [step["label"] for step in steps[:2]] == ["nominal models", "parameters within tolerances"]
    assert steps[-1]["label"] == "noise floor"
    values = [step["value"] for step in steps[1:-1]]
    assert values == sorted(values, reverse=True)
    assert values[0] == report["how_far"]["before"]
    assert values[-1] == report["how_far"]["after"]
    assert {step["label"] for step in steps[2:-1]} == {"+ column.friction", "+ damper.friction"}


@pytest.mark.long
def test_tolerances_alone_are_not_a_gap_and_are_reported_separately(cases: Cases) -> None:
    report = cases.report(seed=3)
    far = report["how_far"]
    assert far["nominal"] > far["before"]
    assert far["before"] == far["after"]
    assert far["before"] == pytest.approx(far["noise_floor"], rel=0.1)
    assert abs(report["tolerances"]["actuator.time_constant"]["z"]) > 1.0


def test_shares_of_two_sites_sum_to_one(cases: Cases) -> None:
    report = cases.report(FOUND["two"])
    shares = {entry["site"]: entry["share"] for entry in report["where"]}
    assert set(shares) == {"column", "damper"}
    assert sum(shares.values()) == pytest.approx(1.0)
    for entry in report["where"]:
        assert entry["share_interval"][0] <= entry["share"] <= entry["share_interval"][1]
    rows = report["details"]["loop_shares"]
    closed = report["details"]["waterfall"][1]["value"]  # of the held-out time; the rows are of all
    assert sum(row["shapley"] for row in rows) == pytest.approx(closed - report["how_far"]["after"], rel=0.35)


@pytest.mark.long
def test_another_recording_of_the_same_laboratories_is_used_to_judge_the_gap(cases: Cases) -> None:
    effects = FOUND["column"]
    other = cases.file(effects, scale=0.15, duration=8.0)
    report = diagnose_file(cases.file(effects), validate=[other]).plain()
    far, own = report["how_far"], cases.report(effects)
    assert (
        report["details"]["waterfall"] == own["details"]["waterfall"]
    )  # of the recording alone, in every step
    assert far["after"] != own["how_far"]["after"]
    assert far["judged_on"] == "other recordings"
    assert far["closed"] > 0.9
    assert far["before"] > far["after"]
    assert far["nominal"] > 0.0


@pytest.mark.long
def test_the_gap_on_a_recording_of_other_laboratories_is_not_closed(cases: Cases) -> None:
    wrong = cases.file({"table.gain": {"factor": 0.93}}, scale=0.15, duration=8.0)
    far = diagnose_file(cases.file(FOUND["column"]), validate=[wrong]).how_far
    assert far.closed is not None
    assert far.closed < 0.0  # adding friction to laboratories without makes it worse


def without_table_target(cases: Cases, effects: Effects | None = None) -> record.Record:
    """A recording that holds no closed loop."""
    run = read(cases.file(FOUND["damper"] if effects is None else effects))
    for topic in ("master", "slave"):
        run.columns[topic].pop("table_target", None)
    run.columns["master"].pop("displacement")
    return record.build(run)


@pytest.fixture(scope="module")
def loopless(cases: Cases) -> Diagnosis:
    """The findings in a recording that holds no closed loop."""
    return examine(without_table_target(cases))


@pytest.fixture(scope="module")
def rubbing(cases: Cases) -> Diagnosis:
    """The findings in a recording of a column with friction."""
    return examine(cases.record(FOUND["column"]))


def test_without_a_loop_the_parts_are_judged_by_themselves(cases: Cases, loopless: Diagnosis) -> None:
    far = how_far.judge(loopless, ())
    closed = far.how_far.plain()
    assert closed["closed"] > 0.9
    assert closed["after"] == pytest.approx(closed["noise_floor"], rel=0.15)
    assert not far.warnings
    judged = how_far.judge(loopless, [without_table_target(cases)])
    assert judged.how_far.judged_on == "other recordings"
    assert judged.how_far.plain()["closed"] > 0.9


def test_the_nominal_gap_is_that_of_the_recordings_on_which_is_judged(
    cases: Cases, loopless: Diagnosis
) -> None:
    own = how_far.judge(loopless, ()).how_far.plain()["nominal"]
    clean = how_far.judge(loopless, [without_table_target(cases, {})]).how_far.plain()
    assert clean["nominal"] < 0.5 * own
    assert clean["nominal"] == pytest.approx(clean["before"], rel=0.2)


def test_what_a_sensor_picks_up_is_a_part_of_the_noise_floor(loopless: Diagnosis, rubbing: Diagnosis) -> None:
    for found in (loopless, rubbing):
        level = float(np.sqrt(np.mean(np.square(found.record.signals["damper_force"]))))
        before, after = (
            gaps.RecordingGaps(one, one.record, np.ones(one.record.ticks, dtype=bool)).floor()
            for one in (found, dataclasses.replace(found, lines={"damper_force": 0.1 * level}))
        )
        assert after.pop("damper_force") == pytest.approx(
            math.hypot(before.pop("damper_force"), 0.1), rel=1e-9
        )
        assert after == before


def test_parts_without_a_loop_are_compared_behind_the_logger(loopless: Diagnosis) -> None:
    found = dataclasses.replace(loopless, record=imported(loopless.record))
    plain, late = dataclasses.replace(found), dataclasses.replace(found)
    plain.__dict__["logger"], late.__dict__["logger"] = {}, {"damper_stroke": (0.0, 1.02)}
    before, after = (
        gaps.RecordingGaps(one, one.record, np.ones(one.record.ticks, dtype=bool)).open(one.systems())
        for one in (plain, late)
    )
    assert after["damper_stroke"] == pytest.approx(1.02 * before["damper_stroke"], rel=1e-12)
    assert after["damper_force"] == pytest.approx(before["damper_force"], rel=1e-12)


def test_a_recording_of_other_parts_judges_nothing_and_says_so(cases: Cases, loopless: Diagnosis) -> None:
    run = read(cases.file(FOUND["damper"]))
    commands = ("table_target", "table_command", "damper_command", "actuator_command")
    for name in ("displacement", "column_force", *commands):
        for topic in ("master", "slave"):
            run.columns[topic].pop(name, None)
    warned = how_far.judge(loopless, [record.build(run)])
    assert warned.how_far.judged_on == "interleaved (interpolation)"
    assert any("no part" in text for text in warned.warnings)


def test_a_recording_without_a_reading_that_was_judged_before_still_judges(
    cases: Cases, loopless: Diagnosis
) -> None:
    run = read(cases.file(FOUND["damper"]))
    for topic in ("master", "slave"):
        run.columns[topic].pop("column_force", None)
    found = how_far.judge(loopless, [record.build(run)]).how_far
    assert found.judged_on != "interleaved (interpolation)"
    assert found.noise_floor


@pytest.mark.long
@pytest.mark.parametrize(
    "effects",
    [
        {"sensor.column_force.noise": {"rms": 500.0}},
        {"sensor.damper_force.quantization": {"step": 2.0}},
    ],
    ids=["noise", "rounding"],
)
def test_a_falsified_reading_counts_once_in_the_noise_floor(cases: Cases, effects: Effects) -> None:
    far: dict[str, Any] = cases.report(effects, duration=8.0)["how_far"]
    assert far["after"] == pytest.approx(far["noise_floor"], rel=0.15)  # counted twice it is 0.26


def test_a_named_site_keeps_its_trace_where_something_is_left_there(
    rubbing: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    partly = [
        dataclasses.replace(item, outcome="partly") if item.effects else item for item in rubbing.verdicts
    ]
    left = SiteTrace("column", np.ones(3), 1.0, "column_force", 1.0)
    monkeypatch.setattr(where, "unexplained", lambda *_: left)
    traces = [
        item
        for item in how_far.all_traces(dataclasses.replace(rubbing, verdicts=partly))
        if item.site == "column"
    ]
    assert len(traces) == 1
    assert traces[0] is not left
    assert traces[0].ratio > 5.0


@pytest.mark.parametrize(("ratio", "sites"), [(0.0, ["column"]), (0.4, ["column", "actuator"])])
def test_where_nothing_is_left_beside_a_doubted_name_no_other_site_is_blamed(
    ratio: float, sites: list[str], rubbing: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    partly = [dataclasses.replace(item, outcome="partly") for item in rubbing.verdicts if item.effects]
    left = SiteTrace("actuator", np.ones(3), ratio, "column_displacement", 1.0)
    monkeypatch.setattr(where, "unexplained", lambda *_: left)
    traces = how_far.all_traces(dataclasses.replace(rubbing, verdicts=partly))
    assert [item.site for item in traces] == sites


def test_an_unknown_effect_has_the_share_that_its_name_would_have(rubbing: Diagnosis) -> None:
    named = next(item for item in rubbing.verdicts if item.effects)
    search = named.search
    unknown = dataclasses.replace(
        named, search=dataclasses.replace(search, chosen=search.commissioned), outcome="unknown"
    )
    verdicts = [unknown if item is named else item for item in rubbing.verdicts]
    alone = SiteTrace("actuator", np.zeros(0), 1.0, "", 1.0)  # which changes nothing
    worth = []
    for found in (rubbing, dataclasses.replace(rubbing, verdicts=verdicts)):
        own = gaps.RecordingGaps(found, found.record, gaps.judging(found)[0])
        _, rows = shares(own, [*how_far.all_traces(found), alone])
        worth.append({row.site: row.shapley for row in rows})
    assert worth[1]["column"] == pytest.approx(worth[0]["column"], rel=0.3)
    assert worth[1]["actuator"] == 0.0


def test_withheld_time_is_between_15_and_60_percent_of_the_test(cases: Cases) -> None:
    mask, _ = gaps.judging(Diagnosis(cases.record(duration=SECONDS)))
    assert 0.15 < np.mean(mask) < 0.6
    assert not mask.all()


def test_the_closed_share_is_that_of_the_gap_above_the_noise() -> None:
    assert closed_share(0.11, 0.02, 0.01) == pytest.approx(0.9)
    assert closed_share(0.01, 0.01, 0.01) == 0.0
    assert overall({"a": 3.0, "b": 4.0}) == pytest.approx(np.sqrt(12.5))
    assert overall({}) == 0.0


def test_a_diverging_simulation_is_reported_as_a_gap(rubbing: Diagnosis) -> None:
    judge = gaps.RecordingGaps(rubbing, rubbing.record, gaps.judging(rubbing)[0])
    assert judge.loop is not None
    systems = rubbing.systems()
    wild_systems = systems | {MASTER: systems[MASTER].moved("actuator", delay=0.2)}
    wild = judge.loop.simulate(wild_systems)
    assert set(judge.gap(wild).values()) == set(judge.gap(None).values()) == {10.0}
    assert how_far.histories(judge, None, judge.signals(None)) == ()
    found = judge.signals(None)
    assert found is not None
    larger = {name: series + 0.1 * rubbing.record.signals[name] for name, series in found.items()}
    assert judge.between(found, larger) == pytest.approx(0.1)
    assert judge.between(None, found) == math.inf
    quiet = dataclasses.replace(judge.loop, names=("column_force",))
    assert set(quiet.gap(judge.signals(None))) == {"column_force"}


@pytest.mark.long
def test_effects_that_hardly_change_the_response_are_judged_by_readings(
    cases: Cases, loopless: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    several = [examine(cases.record(FOUND["damper"])), loopless]
    assert not any(how_far.NOT_SHOWN in how_far.judge(found, ()).warnings for found in several)
    monkeypatch.setattr(gaps.RecordingGaps, "between", lambda *_: 0.0)
    for found in several:
        response = how_far.judge(found, ())
        assert how_far.NOT_SHOWN in response.warnings
        assert response.how_far.closed == pytest.approx(1.0, abs=0.1)


@pytest.mark.long
def test_names_beside_which_the_response_stays_open_have_the_probability_of_a_partial_verdict(
    cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = examine(cases.record(FOUND["column"]))
    closing = report.build(found, ()).report
    monkeypatch.setattr(how_far, "shrinks", lambda *_: False)
    open_ = report.build(found, ()).report
    assert (closing.status, open_.status) == ("explained", "partly_explained")
    assert open_.which[0].probability == trust.PARTLY.probability(trust.signs(found))
    assert (closing.which[0].probability or 0.0) > 0.9
