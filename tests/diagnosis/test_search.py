"""Effects of every site are found in laboratories whose parameters are slightly off; clean ones have none."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from diagnosis.fits import candidates, evidence, fitting, residuals, screening, settling, unexplained, worth
from diagnosis.fits import search as searching
from diagnosis.fits.fitting import Fit
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import Search, inside_ranges, likeliest, search, trimmed, with_weaker
from laboratories.effects import CATALOGUE
from tests.diagnosis.cases import (
    SECONDS,
    STRONGEST,
    Cases,
    Effects,
    counts_as,
    estimate,
    lab_a,
    lab_b,
    named,
    white,
)
from tests.diagnosis.test_equivalents import DATA, NOISY
from tests.diagnosis.test_laws import Sizes

# play behind the loop, of which the law of play before the loop promises nothing
PLAYED = {"width": 1.5e-4, "contact": 200.0, "flank": 0.7, "guide": 628.0, "law": 1.0}
BACK = {"width": 2e-4, "law": 2.0, "spring_back": 6e-3}
LANDS = {"width": 4e-4, "law": 2.0, "null_gain": 0.08}
ALONE: list[tuple[str, dict[str, float], dict[str, float]]] = [  # effect, truth, relative error allowed
    ("ground.scale", {"factor": 1.08}, {"factor": 0.005}),
    ("structure.mass", {"factor": 1.1}, {"factor": 0.05}),
    ("actuator.backlash", {"width": 2e-4}, {"width": 0.05}),
    ("actuator.backlash", {"width": 2e-4, "law": 1.0}, {"width": 0.05, "law": 0.0}),
    ("table.backlash", PLAYED, {"width": 0.05, "law": 0.0}),
    ("table.backlash", {**PLAYED, "width": 6e-4}, {"law": 0.0}),  # the platform never reaches a flank
    ("actuator.backlash", BACK, {"width": 0.05, "spring_back": 0.1}),
    ("actuator.deadband", {"width": 4e-4, "law": 1.0}, {"width": 0.05, "law": 0.0}),
    ("actuator.deadband", LANDS, {"width": 0.05, "null_gain": 0.1, "law": 0.0}),
    ("actuator.compliance", {"compliance": 1.5e-8, "law": 1.0}, {"compliance": 0.05, "law": 0.0}),
    ("actuator.delay", {"delay": 6e-3}, {"delay": 0.1}),  # the plan's own delay is known to 0.28 ms only
    ("column.friction", {"force": 900.0}, {"force": 0.05}),
    ("column.yielding", {"yield_displacement": 1.2e-3, "hardening": 0.1}, {"yield_displacement": 0.05}),
    ("damper.force_limit", {"force": 30.0, "law": 1.0, "sharpness": 3.0}, {"force": 0.05, "law": 0.0}),
    ("table.gain", {"factor": 0.93}, {"factor": 0.01}),
    (
        "table.friction",
        {"acceleration": 0.3, "law": 2.0, "presliding": 1e-4},
        {"acceleration": 0.05, "presliding": 0.1, "law": 0.0},
    ),
    ("damper.friction", {"force": 3.0}, {"force": 0.05}),
    ("damper.viscous", {"factor": 1.5}, {"factor": 0.05}),
    ("column.hardening", {"share": -0.05}, {"share": 0.1}),
    ("sensor.column_displacement.gain", {"factor": 1.08}, {"factor": 0.02}),
    ("sensor.column_force.saturation", {"limit": 5e4}, {"limit": 0.1}),
    ("sensor.column_force.high_pass", {"time_constant": 1.0}, {"time_constant": 0.05}),
    ("sensor.table_acceleration.high_pass", {"time_constant": 0.5}, {"time_constant": 0.05}),
]
RARE = ("table.backlash",)  # the platform meets a flank seldom


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Cases:
    """Recordings with known secrets, made on demand, no longer than the strongest motion."""
    return Cases(tmp_path_factory, STRONGEST)


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "values", "near"),
    [pytest.param(*row, id=row[0], marks=pytest.mark.slow if row[0] in RARE else ()) for row in ALONE],
)
def test_an_effect_is_found_with_its_parameters(
    cases: Cases, effect: str, values: dict[str, float], near: dict[str, float]
) -> None:
    report = cases.report({effect: values}, duration=SECONDS if effect in RARE else None)
    assert counts_as(report, effect), named(report)
    assert len(named(report)) == 1
    assert report["status"] == "explained"
    for name, error in near.items():
        assert estimate(report, effect, name) == pytest.approx(values[name], rel=error)


@pytest.mark.parametrize(("surer", "leads"), [(20.0, "b"), (2.0, "a")])
def test_an_effect_that_shows_under_loud_noise_gives_way_to_a_far_likelier_one_in_its_place(
    monkeypatch: pytest.MonkeyPatch, surer: float, leads: str
) -> None:
    bare, a, b = (Fit(DATA, {name: {} for name in names}, np.zeros(0), NOISY) for names in ("", "a", "b"))
    monkeypatch.setattr(candidates, "best_laws", lambda *_: [a])
    monkeypatch.setattr(worth, "is_gap", lambda _: True)
    monkeypatch.setattr(worth, "is_worth", lambda *_: True)
    monkeypatch.setattr(settling, "stands_out", lambda _: True)
    monkeypatch.setattr(settling, "remodelled", lambda fit: fit)
    monkeypatch.setattr(settling, "instead_of_colour", lambda *_: (bare, [b]))
    monkeypatch.setattr(evidence, "surprise", lambda fit: -surer if fit is b else 0.0)
    assert searching.one_by_one(bare, Sizes())[1][0].names == (leads,)


@pytest.mark.long
def test_an_effect_that_acts_in_one_second_only_is_found_with_no_second_withheld(cases: Cases) -> None:
    effects = {"actuator.velocity_limit": {"velocity": 0.025}}
    report = cases.report(effects, duration=SECONDS)  # 32 mm/s in the third, 21 elsewhere
    assert (report["status"], named(report)) == ("explained", ["actuator.velocity_limit"])
    assert estimate(report, "actuator.velocity_limit", "velocity") == pytest.approx(0.025, rel=0.01)
    assert report["how_far"]["judged_on"] == "same seconds"
    assert report["how_far"]["closed"] > 0.9


@pytest.mark.long
def test_a_valve_whose_speed_falls_with_the_load_is_found(cases: Cases) -> None:
    name = "actuator.velocity_limit"
    report = cases.report({name: {"velocity": 0.02, "law": 2.0, "stall": 5e4}})
    assert (report["status"], named(report)) == ("explained", [name])
    assert estimate(report, name, "law") == 2.0
    assert estimate(report, name, "stall") == pytest.approx(5e4, rel=0.02)


@pytest.mark.parametrize("sides", [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
def test_what_effects_leave_on_one_side_is_searched_with_nothing_withheld(
    cases: Cases, monkeypatch: pytest.MonkeyPatch, sides: tuple[float, float]
) -> None:
    whole = cases.record()
    data, seen = residuals.prepare(lab_a(whole), whole), []
    left = fitting.at(data, {"column.friction": {"force": 900.0}}, np.zeros(len(data.part.nuisances)))
    far = np.where(data.train, *sides)[:, None] * 9.0 + 1.0
    left = replace(left, reduced=far * np.ones(data.sigma.size))

    def searched(bare: Fit, _scales: Scales) -> Search:
        seen.append(bool(bare.data.train.all()))
        return Search(bare.data, bare, left, ())

    monkeypatch.setattr(searching, "searched", searched)
    search(data, Scales(whole))
    assert seen == ([False] if sides == (1.0, 1.0) else [False, True])


STOP: Effects = {"damper.stroke_stop": {"stroke": 0.04, "stiffness": 2000.0}}


@pytest.mark.slow
def test_an_end_stop_is_found_with_its_stroke(cases: Cases) -> None:
    report = cases.report(STOP, duration=6.0)  # after some impacts
    assert named(report) == ["damper.stroke_stop"]
    assert estimate(report, "damper.stroke_stop", "stroke") == pytest.approx(0.04, rel=0.05)


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_a_clean_laboratory_gives_no_effect(cases: Cases, seed: int) -> None:
    report = cases.report(seed=seed)
    assert report["status"] == ("within_tolerances" if seed else "no_gap")
    assert named(report) == []
    assert report["where"] == report["equivalent"] == []
    assert report["which"][0]["probability"] > 0.7
    assert report["next_test"] == ""


LATE = "sensor.column_force.delay"


@pytest.mark.long
def test_a_delayed_force_reading_is_found_with_its_delay_in_the_verdict_and_the_force_path(
    cases: Cases,
) -> None:
    report = cases.report({LATE: {"delay": 0.002}})
    assert named(report) == [LATE]
    assert [entry["site"] for entry in report["where"]] == ["sensor.column_force"]
    assert estimate(report, LATE, "delay") == pytest.approx(0.002, abs=2e-4)
    path = report["details"]["force_path"]
    assert path["delay"] == pytest.approx(0.002, abs=1e-4)
    assert path["interval"][0] <= 0.002 <= path["interval"][1]


@pytest.mark.long
def test_a_short_delay_and_a_lag_of_the_same_size_are_reported_as_equivalent(cases: Cases) -> None:
    report = cases.report({LATE: {"delay": 0.0006}})
    assert [LATE, "sensor.column_force.lag"] in [sorted(names) for names in report["equivalent"]]


LEAKY: Effects = {
    "actuator.deadband": {"width": 4e-4, "law": 1.0},
    "column.stiffness": {"factor": 1.2},
}


@pytest.mark.slow
def test_an_effect_that_was_found_first_changes_its_law_beside_a_second_one(cases: Cases) -> None:
    report = cases.report(LEAKY)
    assert report["status"] == "explained"
    assert counts_as(report, "column.stiffness")
    assert estimate(report, "actuator.deadband", "law") == 1.0
    assert estimate(report, "actuator.deadband", "width") == pytest.approx(4e-4, rel=0.05)


@pytest.mark.long
def test_effects_that_may_stand_for_another_are_looked_at_under_all_their_laws(cases: Cases) -> None:
    whole = cases.record(LEAKY)
    data, scales = residuals.prepare(lab_a(whole), whole), Scales(whole)
    wrong = fitting.fit(data, {"actuator.backlash": {"width": 3e-4}, "column.stiffness": {"factor": 1.2}})
    best = candidates.alternatives(wrong, [], scales)[0]
    assert best.values["actuator.deadband"]["law"] == 1.0
    assert fitting.excess(best) < 1e-3 * fitting.excess(wrong)


@pytest.mark.long
@pytest.mark.parametrize("true", ["column.stiffness", "sensor.column_force.gain"])
def test_effects_that_the_signals_cannot_tell_apart_are_reported_together(cases: Cases, true: str) -> None:
    report = cases.report({true: {"factor": 1.1}})
    assert counts_as(report, true)
    assert ["column.stiffness", "sensor.column_force.gain"] in [
        sorted(names) for names in report["equivalent"]
    ]


def test_noise_gives_no_gap_and_a_trend_does() -> None:
    for seed in range(20):
        assert unexplained.gap(white(seed, 1250), 4).ratio < unexplained.MATERIAL
    slow = 2.0 * np.sin(np.linspace(0.0, 60.0, 1250))
    found = unexplained.gap(white(0, 1250) + slow, 4)
    assert found.significance > 20.0
    assert found.ratio == pytest.approx(
        np.sqrt(2.0) / np.sqrt(4.0), rel=0.15
    )  # rms over that of a single sample
    assert unexplained.gap(np.zeros(5), 4) == (0.0, 0.0)


def test_a_search_reports_its_effect_the_explained_share_and_costlier_alternatives(cases: Cases) -> None:
    whole = cases.record({"column.friction": {"force": 900.0}})
    data = residuals.prepare(lab_a(whole), whole)
    found = search(data, Scales(whole))
    assert found.chosen.names == ("column.friction",)
    assert found.explained > 0.99
    assert found.left < unexplained.MATERIAL
    assert fitting.excess(found.chosen) < 0.01 * fitting.excess(found.commissioned)
    costs = [item.cost for item in found.alternatives]
    assert costs == sorted(costs)
    assert costs[0] > found.chosen.cost + fitting.TIED


def test_no_more_delay_is_taken_away_than_there_is(cases: Cases) -> None:
    whole = cases.record()
    data = residuals.prepare(lab_a(whole), whole)
    there = whole.plan.actuator.delay
    less = fitting.at(data, {"actuator.delay": {"delay": -3.0 * there}}, np.zeros(len(data.part.nuisances)))
    assert trimmed(less).values["actuator.delay"]["delay"] == pytest.approx(-there, rel=1e-3)
    half = replace(less, values={"actuator.delay": {"delay": -0.5 * there}})
    assert trimmed(half) is half


LINKS: dict[str, Effects] = {
    "delay": {"link.delay": {"delay": 0.004}},
    "loss": {"link.loss": {"probability": 0.05, "burst": 2.0}},
    "jitter": {"link.jitter": {"std": 0.002}},
}


@pytest.mark.long
@pytest.mark.parametrize("kind", LINKS)
def test_an_impaired_link_is_found_and_nothing_else(cases: Cases, kind: str) -> None:
    report = cases.report(LINKS[kind], duration=8.0)
    assert named(report) == sorted(LINKS[kind])
    assert report["status"] == "explained"
    assert [entry["site"] for entry in report["where"]] == ["link"]
    for effect, values in LINKS[kind].items():
        for name, true in values.items():
            assert estimate(report, effect, name) == pytest.approx(true, rel=0.3), name
    assert report["how_far"]["after"] < 1.2 * report["how_far"]["noise_floor"]


def test_a_reading_that_saturates_is_also_looked_for_above_what_was_reached(cases: Cases) -> None:
    record = cases.record()
    scales, effect = Scales(record), CATALOGUE["sensor.column_force.saturation"]
    limits = [values["limit"] for _, values in scales.starts(effect)]
    peak = scales.peak("column_force")
    assert min(limits) < peak < 2.0 * peak < max(limits)


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "motion"),
    [("actuator.backlash", "column_displacement"), ("table.backlash", "table_displacement")],
)
def test_a_play_that_swallows_most_of_a_small_motion_is_found(cases: Cases, effect: str, motion: str) -> None:
    width = 1.4 * Scales(cases.record(scale=0.01, duration=8.0)).peak(motion)
    report = cases.report({effect: {"width": width}}, scale=0.01, duration=8.0)
    assert named(report) == [effect]
    assert estimate(report, effect, "width") == pytest.approx(width, rel=0.05)


def test_an_effect_that_is_small_beside_another_is_named_where_both_leave_only_noise(
    cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worth, "moving", fitting.excess)  # as if the constant force were none
    effects = {"damper.offset": {"force": 40.0}, "table.gain": {"factor": 0.99}}
    found = cases.record(effects)
    part = lab_b(found)
    part.candidates = tuple(one for one in part.candidates if one.name in {*effects, "damper.viscous"})
    data, scales = residuals.prepare(part, found), Scales(found)
    alone = fitting.fit(data, {"damper.offset": effects["damper.offset"]})
    assert not worth.refines(fitting.fit(data, {}), alone, fitting.fit(data, effects))
    assert set(with_weaker(alone, scales).names) == set(effects)
    assert set(with_weaker(fitting.fit(data, effects), scales).names) == set(effects)


@pytest.mark.parametrize(("left", "refines"), [(6.0, True), (4e5, False)])
def test_an_effect_that_leaves_hardly_anything_is_worth_it_however_large_the_whole_gap(
    monkeypatch: pytest.MonkeyPatch, left: float, refines: bool
) -> None:
    excess = {"bare": 2e9, "one": 9e5, "two": left}
    monkeypatch.setattr(worth, "excess", lambda fit: excess[fit.name])
    monkeypatch.setattr(worth, "moving", lambda fit: excess[fit.name])
    monkeypatch.setattr(worth, "remaining", lambda _: 2.0 * worth.LOUD)
    bare, one, two = (SimpleNamespace(name=name, data=SimpleNamespace(energy=4e9)) for name in excess)
    assert worth.refines(bare, one, two) is refines  # type: ignore[arg-type]


def test_a_reading_that_is_off_by_a_constant_is_no_gap_beside_which_others_are_small() -> None:
    off = Fit(DATA, {}, np.zeros(0), NOISY + 30.0)
    moved = Fit(DATA, {}, np.zeros(0), NOISY + 3.0 * np.sin(0.2 * np.arange(DATA.groups))[:, None])
    assert worth.moving(off) < 0.01 * fitting.excess(off)
    assert worth.moving(moved) > 0.95 * fitting.excess(moved)


def test_a_signal_that_was_not_recorded_does_not_pay_for_what_another_leaves(cases: Cases) -> None:
    whole = cases.record()
    part = lab_b(whole)
    missing = {"damper_stroke", "damper_force"}
    kept = np.array([name not in missing for name in part.signals])
    half = part.replaced(present=part.present & kept)
    data = residuals.prepare(half, whole)
    left = Fit(data, {}, np.zeros(0), np.where(kept, 1.3, 0.0) * np.ones((data.groups, 1)))
    assert data.size == 2 * data.groups
    assert fitting.excess(left) == pytest.approx((1.3**2 - 1.0) * data.size)


@pytest.mark.parametrize(("z", "left", "worthy"), [(3.1, 0.65, True), (3.1, 0.75, False), (2.9, 0.3, False)])
def test_an_effect_that_brings_nominal_parameters_back_may_explain_less(
    monkeypatch: pytest.MonkeyPatch, z: float, left: float, worthy: bool
) -> None:
    monkeypatch.setattr(worth, "changes", lambda fit: [np.array([1e3 * fit.data.group])])
    monkeypatch.setattr(worth, "cancelling", lambda *_: False)
    gap = np.sin(0.2 * np.arange(DATA.groups))[:, None]
    bare = Fit(DATA, {}, np.zeros(1), NOISY + 1e4 * gap)
    before = Fit(DATA, {"a": {}}, np.array([z]), NOISY + 20.0 * gap)
    after = Fit(DATA, {"a": {}, "b": {}}, np.zeros(1), NOISY + 20.0 * np.sqrt(left) * gap)
    assert worth.is_worth(bare, before, after) is worthy


def test_a_far_likelier_exchange_of_one_effect_stands_in_front(cases: Cases) -> None:
    found = cases.record({"damper.viscous": {"factor": 1.5}})
    data = residuals.prepare(lab_b(found), found)
    bare = fitting.fit(data, {})
    true, wrong = (
        fitting.fit(data, {name: {"factor": 1.2}}) for name in ("damper.viscous", "damper.stiffness")
    )
    ordered = likeliest(Search(data, bare, wrong, (true,)))
    assert (ordered.chosen, ordered.alternatives) == (true, (wrong,))
    known = Search(data, bare, true, (wrong,))
    assert likeliest(known) is known
    more = replace(known, chosen=wrong, alternatives=(fitting.at(data, true.values | wrong.values, true.z),))
    assert likeliest(more) is more


@pytest.mark.parametrize(("left", "first"), [(0.08, "damper.viscous"), (0.2, "damper.gain")])
def test_effects_at_the_end_of_their_ranges_stand_behind_others_that_leave_nothing_to_see(
    cases: Cases, monkeypatch: pytest.MonkeyPatch, left: float, first: str
) -> None:
    found = cases.record({"damper.viscous": {"factor": 1.5}})
    data = residuals.prepare(lab_b(found), found)
    most = data.catalogue["damper.gain"].parameters[0].most
    bare, end, other = (
        fitting.at(data, values, np.zeros(len(data.part.nuisances)))
        for values in ({}, {"damper.gain": {"factor": most}}, {"damper.viscous": {"factor": 1.4}})
    )
    monkeypatch.setattr("diagnosis.fits.search.remaining", lambda _: left)
    assert inside_ranges(Search(data, bare, end, (other,))).chosen.names == (first,)
    assert inside_ranges(Search(data, bare, other, (end,))).chosen is other


def test_a_force_that_stands_still_is_looked_for_far_beyond_what_the_motion_makes(cases: Cases) -> None:
    whole = cases.record({"damper.offset": {"force": -2.0}}, scale=2e-4)
    bare = fitting.fit(residuals.prepare(lab_b(whole), whole), {})
    (found,) = screening.screen(bare, [CATALOGUE["damper.offset"]], Scales(whole))
    assert found.values["force"] == pytest.approx(-2.0, rel=0.1)


@pytest.mark.long
def test_an_effect_is_found_that_shows_most_in_the_seconds_that_a_fit_sees(cases: Cases) -> None:
    effects = {"sensor.damper_force.saturation": {"limit": 55.0, "sharpness": 6.0}}
    whole = cases.record(effects, duration=8.0)
    data = residuals.prepare(lab_b(whole), whole)
    found = search(replace(data, train=~data.train), Scales(whole, 0.0))  # the peak is seen
    assert found.chosen.names == tuple(effects)
    assert found.chosen.values["sensor.damper_force.saturation"]["limit"] == pytest.approx(55.0, rel=1e-3)
