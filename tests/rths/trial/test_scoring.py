"""Scoring: right and wrong verdicts with their reasons, and the measures with their goals."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from common.roles import MASTER, SLAVE
from diagnosis.report import read
from diagnosis.report.values import Value
from tests.rths.diagnosis_report.pieces import bare
from tests.rths.report.pages import check_alone, check_in_browser
from validation.blind.cases.case import Case, Laid
from validation.blind.judge import DiagnosisAnswer
from validation.blind.record import RecordedCase
from validation.blind.results.calibration import clopper_pearson
from validation.blind.results.measures import (
    binned,
    by_size,
    calibration_bounds,
    confusion,
    confusion_by_site,
    measures,
    quantile,
    rate,
    reached,
    reliability,
    results,
)
from validation.blind.results.page import page
from validation.blind.results.scoring import Outcome, estimate, judge, judge_all, same

SLIP = Laid("column.slip", "column", {"gap": 2e-4}, {"gap": 0.0}, role=MASTER)
SOFT = Laid("column.stiffness", "column", {"factor": 0.9}, {"factor": 1.0}, role=MASTER)
RUB = Laid("damper.friction", "damper", {"force": 3.0}, {"force": 0.0}, role=SLAVE)
CABLE = Laid("damper.cable", "damper", {"force": 1.0}, {}, role=SLAVE)


def case(kind: str, *laid: Laid, inside: bool = False, index: int = 0) -> Case:
    return Case(index, kind, {"test": {"duration": 15.0}}, {}, 1, laid, inside)


PLACE = {
    "share": 1.0,
    "share_interval": [1.0, 1.0],
    "residual_to_noise": 9.0,
    "when": [],
    "frequency_band": None,
}


def answer(
    status: str, *effects: str, site: str = "", probability: float = 0.9, **more: Any
) -> dict[str, Any]:
    report = bare(status)
    report["where"] = [PLACE | {"site": site}] if site else []
    if effects:
        first = {
            "effects": list(effects),
            "probability": probability,
            "parameters": {},
            "held_out_score": 0.0,
        }
        report["which"] = [first]
    return report | more


def value(number: float, *interval: float) -> dict[str, Any]:
    return {"value": number, "interval": list(interval), "unit": ""}


def judged(what: Case, report: dict[str, Any], *sizes: float, seconds: float = 2.0) -> Outcome:
    sizes = sizes or tuple(10.0 for _ in what.laid)
    return judge(
        what,
        RecordedCase(what.index, "a.mcap", sizes, ""),
        DiagnosisAnswer({"": read.report(report)}, seconds),
    )


def test_the_true_effect_at_its_site_is_right() -> None:
    outcome = judged(case("catalogue", RUB), answer("explained", "damper.friction", site="damper"))
    assert outcome.right
    assert outcome.named
    assert outcome.located
    assert not outcome.surplus
    assert outcome.why == ""
    assert outcome.seconds == 4.0


@pytest.mark.parametrize(("before", "judges"), [(0.281, False), (0.5, True)])
def test_a_second_motion_that_hardly_shows_the_gap_judges_no_share(before: float, judges: bool) -> None:
    what = replace(case("material", SLIP), other={"test": {}})
    far = bare("explained")["how_far"] | {"before": before, "after": 0.28, "closed": 0.0, "noise_floor": 0.28}
    outcome = judged(what, answer("explained", "column.slip", site="column", how_far=far))
    assert outcome.twice is judges


def test_another_effect_is_wrong_and_the_reason_is_given() -> None:
    outcome = judged(case("catalogue", RUB), answer("explained", "column.slip", site="column"), 1.0)
    assert not outcome.right
    assert outcome.surplus
    assert outcome.why == (
        "reports column.slip, not damper.friction; first site is column, not damper; residual to noise below 2"
    )


def test_an_effect_does_not_count_as_named_if_the_status_denies_it() -> None:
    outcome = judged(case("catalogue", RUB), answer("no_gap", "damper.friction", site="damper"))
    assert not outcome.named
    assert outcome.verdict == []
    assert math.isnan(outcome.probability)


def test_a_set_of_equivalents_counts_for_effect_and_site() -> None:
    twin = "sensor.column_force.gain"
    report = answer("ambiguous", twin, site="sensor.column_force", equivalent=[["column.stiffness", twin]])
    assert judged(case("catalogue", SOFT), report).right
    report["equivalent"] = []
    assert not judged(case("catalogue", SOFT), report).right
    assert same("a", "a", [])
    assert not same("a", "b", [{"a", "c"}, {"b", "c"}])


def test_both_effects_of_a_pair_must_be_in_the_verdict() -> None:
    both = answer("explained", "damper.friction", "column.slip", site="column")
    assert judged(case("pair", RUB, SLIP), both, 5.0, 3.0).right
    assert judged(case("pair", RUB, SLIP), both, 5.0, 3.0).size == 3.0
    one = judged(case("pair", RUB, SLIP), answer("explained", "damper.friction", site="damper"))
    assert not one.right
    assert one.why == "reports damper.friction, not damper.friction and column.slip"


def test_one_name_is_credited_to_one_effect_of_a_pair() -> None:
    twins = [["damper.friction", "column.slip"]]
    one = answer("explained", "damper.friction", site="damper", equivalent=twins)
    assert judged(case("catalogue", SLIP), one | {"where": [PLACE | {"site": "column"}]}).named
    outcome = judged(case("pair", RUB, SLIP), one)
    assert (outcome.named, outcome.listed, outcome.asked) == (False, 1, 2)
    both = answer("explained", "column.slip", "damper.friction", site="damper", equivalent=twins)
    outcome = judged(case("pair", RUB, SLIP), both)
    assert (outcome.named, outcome.listed) == (True, 2)


def test_a_clean_laboratory_has_no_gap() -> None:
    assert judged(case("clean"), answer("no_gap")).right
    alarm = judged(case("clean"), answer("explained", "column.slip", site="column"))
    assert not alarm.right
    assert alarm.surplus
    assert alarm.why == "reports column.slip, not no_gap"


def test_an_effect_within_the_tolerances_may_be_reported_as_no_gap() -> None:
    assert judged(case("catalogue", SOFT, inside=True), answer("no_gap")).right
    assert not judged(case("catalogue", SOFT, inside=True), answer("no_gap")).visible
    assert not judged(case("catalogue", SOFT), answer("no_gap")).right


@pytest.mark.parametrize(
    ("true", "normal", "said", "right"),
    [
        (26.6e6, True, 1.044, True),
        (26.6e6, True, 0.97, False),
        (25.8e6, True, 1.044, False),
        (26.6e6, False, 1.044, False),
    ],
)
def test_a_parameter_that_is_truly_more_than_two_tolerances_off_may_be_named(
    true: float, normal: bool, said: float, right: bool
) -> None:
    plain = case("clean")
    what = replace(plain, truths={"structure": {"stiffness": true}}, normal=normal)
    report = answer("explained", "structure.stiffness")
    report["which"][0]["parameters"] = {
        "structure.stiffness": {"factor": value(said, said - 0.01, said + 0.01)}
    }
    found = judged(what, report)
    assert (found.right, found.surplus) == (right, 0 if right else 1)


def test_an_unknown_effect_is_right_if_reported_as_unknown_at_its_site() -> None:
    assert judged(case("unknown", CABLE), answer("unknown_effect", site="damper")).right
    assert judged(
        case("unknown", CABLE), answer("partly_explained", "damper.friction", site="damper", probability=0.3)
    ).right
    assert not judged(case("unknown", CABLE), answer("unknown_effect", site="column")).right
    assert not judged(case("unknown", CABLE), answer("explained", "damper.friction", site="damper")).right


def test_a_diagnosis_that_fails_is_wrong() -> None:
    failed = DiagnosisAnswer({}, 2.0, "ValueError: no")
    outcome = judge(case("catalogue", RUB), RecordedCase(0, "a.mcap", (10.0,), ""), failed)
    assert outcome.why == "ValueError: no"
    missing = judge_all([case("clean", index=7)], {7: RecordedCase(7, "x.mcap", (), "")}, {})
    assert [item.status for item in missing] == ["error"]


def test_a_parameter_is_judged_relative_to_its_distance_from_the_null_value() -> None:
    report = answer("explained", "column.stiffness", site="column")
    report["which"][0]["parameters"] = {"column.stiffness": {"factor": value(0.91, 0.9, 0.92)}}
    (one,) = judged(case("catalogue", SOFT), report).estimates
    assert one.error == pytest.approx(0.1)
    assert one.plain_error == pytest.approx(0.01 / 0.9)
    assert one.inside is True
    report["which"][0]["parameters"] = {"column.stiffness": {}}
    assert judged(case("catalogue", SOFT), report).estimates[0].error == math.inf


def some() -> list[Outcome]:
    far = bare("explained")["how_far"] | {"closed": 0.97}
    good = answer("explained", "damper.friction", site="damper", probability=1.0, how_far=far)
    good["which"][0]["parameters"] = {"damper.friction": {"force": value(3.03, 2.9, 3.1)}}
    return [
        *(judged(case("catalogue", RUB, index=i), good) for i in range(19)),
        judged(case("formula", SLIP, index=19), answer("unknown_effect", site="column")),
        judged(case("catalogue", SOFT, index=20), answer("no_gap"), 0.3),
        judged(case("pair", RUB, SLIP, index=21), answer("explained", "column.slip", site="column")),
        judged(case("clean", index=22), answer("no_gap")),
        judged(case("unknown", CABLE, index=23), answer("unknown_effect", site="damper"), seconds=9.0),
    ]


def test_the_coefficient_of_a_power_law_is_judged_at_the_catalogues_speed() -> None:
    laid = Laid("column.viscous", "column", {"coefficient": 1e4}, {"coefficient": 0.0}, "power", MASTER)
    true = 1e4 * (0.1 / 0.02) ** -0.2  # the same force at 0.1 m/s as at 0.02 m/s
    for said, held in ((true, True), (1e4, False)):
        value = Value(value=said, interval=(0.99 * said, 1.01 * said), unit="N·s/m")
        judged = estimate(laid, laid.name, "coefficient", value)
        assert judged.true == pytest.approx(true)
        assert judged.inside == held
    linear = replace(laid, formula="maxwell")
    assert estimate(linear, laid.name, "coefficient", None).true == 1e4


def test_measures_pass_and_fail_against_their_goals() -> None:
    table = {item.name: item for item in measures(some())}
    first = table["right effect first"]
    assert (first.value, first.count, first.verdict, first.goal) == (
        0.95,
        20,
        "too few cases to say",
        "≥ 95.0 %",
    )
    assert first.low < 0.8
    assert 0.95 < first.high < 1.0
    assert table["right site first"].value == 1.0
    assert table["both of a pair"].verdict == "too few cases to say"  # one case
    assert table["clean laboratory: no gap"].verdict == "too few cases to say"
    assert table["both of a pair whose strongest is visible"].verdict == ""
    assert table["parameter error, median"].value == pytest.approx(0.01)
    assert table["parameter error, median"].verdict == "pass"
    assert table["shrinkage over the best possible, median"].value == pytest.approx(0.97)
    assert table["right effect first, all sizes"].count == 21
    assert table["right effect first, formula"].value == 0.0
    assert table["abstention where there is an effect"].count == 22
    assert table["stated intervals that hold the true parameter"].value == 1.0
    assert table["time per 30 s of test, 95th percentile"].value == 4.0


def test_a_goal_without_cases_is_not_met() -> None:
    assert rate("x", [], lambda _: True, 0.9).passed is None
    assert quantile("x", [], least=0.9).passed is None
    assert all(item.passed is None and not item.verdict for item in measures([]))


def test_a_goal_is_missed_only_if_the_cases_are_significant() -> None:
    assert quantile("x", [1.0, math.nan, math.nan], least=0.9).verdict == "too few cases to say"
    assert quantile("x", [1.0] + [math.nan] * 20, least=0.9).verdict == "FAIL"
    assert quantile("x", [0.01] + [math.nan] * 20, most=0.9).verdict == "FAIL"
    assert quantile("x", [0.01] * 20, most=0.9).verdict == "pass"
    for hits, count, verdict in (
        (0, 1, None),
        (1, 1, None),
        (0, 5, False),
        (90, 100, None),
        (80, 100, False),
    ):
        assert reached(hits, count, 0.95) is verdict
    assert reached(298, 300, 0.95) is True
    low, high = clopper_pearson(8, 10)
    assert low == pytest.approx(0.4439, abs=1e-4)  # their table
    assert high == pytest.approx(0.9748, abs=1e-4)
    assert calibration_bounds([(0.9, False)])[0] < 0.05
    assert calibration_bounds([(0.9, False)] * 50)[0] > 0.5


def test_confusion_matrices_contain_every_case_except_pairs() -> None:
    matrix = confusion(some())
    assert matrix["damper.friction"] == {"damper.friction": 19}
    assert matrix["column.slip"] == {"unknown": 1}
    assert matrix["column.stiffness"] == {"no gap": 1}
    assert matrix["no gap"] == {"no gap": 1}
    assert confusion_by_site(some())["none"] == {"none": 1}
    assert sum(sum(row.values()) for row in confusion_by_site(some()).values()) == 23


def test_calibration_bins_contain_every_value_once() -> None:
    bins = binned([(0.0, True), (0.1, False), (1.0, True)], (0.0, 0.1, 0.5, 1.0))
    assert [(item.count, item.share) for item in bins] == [(1, 1.0), (1, 0.0), (1, 1.0)]
    assert sum(item.count for item in by_size(some())) == 21
    assert sum(item.count for item in reliability(some())) == 20


@pytest.mark.long
def test_results_are_json_and_their_page_loads_nothing_from_elsewhere() -> None:
    text = json.dumps(results(some()), allow_nan=False)
    assert len(json.loads(text)["cases"]) == 24
    shown = page(some(), "Made <here>.")
    assert shown.count("data:image/png;base64,") == 4
    assert "Made &lt;here&gt;." in shown
    assert "reports column.slip, not damper.friction and column.slip" in shown
    assert "http" not in shown
    text = check_alone(shown).text
    assert "21 of 24 cases right." in text
    assert check_alone(page([], "")).text.endswith("Cases that are not right None.")
    assert page([], "").count("data:image/png") == 4


@pytest.mark.slow
def test_the_page_of_the_results_is_drawn_in_a_browser(tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text(page(some(), "Made here."), encoding="utf-8")
    check_in_browser(tmp_path / "index.html", tmp_path)
