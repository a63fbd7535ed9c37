"""Several effects in one laboratory: what stands in for two, and what hides behind a strained parameter."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from diagnosis.fits import candidates, fitting, residuals, trade, worth
from diagnosis.fits.fitting import Fit, excess
from diagnosis.fits.hypothesis import Values
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import may_lack, needed, with_weaker
from models.registry import Array
from tests.diagnosis.cases import Cases, Effects, lab_a, lab_b
from tests.diagnosis.test_equivalents import DATA, NOISY

# three of them leave little, with the nominal stiffness at the end of its range
FOUR: Effects = {
    "actuator.time_constant": {"factor": 1.12},
    "actuator.delay": {"delay": 0.0021},
    "column.degradation": {"rate": 0.0445},
    "column.stiffness": {"factor": 1.07},
}


def fit(names: str, z: float = 0.0, off: Array | float = 0.0) -> Fit:
    return Fit(DATA, {name: {} for name in names}, np.full(1, z), NOISY + off)


def test_a_signal_of_less_than_its_noise_does_not_pay_for_what_another_one_misses() -> None:
    live = np.ones(2, dtype=bool)
    data = SimpleNamespace(
        live=live, groups=1000, size=2000, judging=np.ones(1000, dtype=bool), train=np.zeros(1000, dtype=bool)
    )
    noise = np.random.default_rng(1).standard_normal((1000, 2))

    def left(*sizes: float) -> Fit:
        return Fit(data, {}, np.zeros(0), noise / noise.std(axis=0) * sizes)  # type: ignore[arg-type]

    assert excess(left(0.97, 1.03)) < 10.0  # as chance has it
    assert left(0.5, 1.2).chi < data.size
    assert excess(left(0.5, 1.2)) > 300.0


@pytest.mark.long
def test_an_effect_beside_three_is_found_by_the_nominal_parameter_that_stands_in_for_it(cases: Cases) -> None:
    whole = cases.record(FOUR, seed=0)
    data, scales = residuals.prepare(lab_a(whole), whole), Scales(whole)
    three = fitting.fit(data, {name: dict(FOUR[name]) for name in list(FOUR)[:3]})
    assert worth.strained(three)
    names = set(with_weaker(three, scales).names)
    assert set(list(FOUR)[:3]) < names
    assert names - set(FOUR) <= {"sensor.column_force.gain", "sensor.column_displacement.gain"}


@pytest.mark.parametrize(
    ("before", "after", "count", "taken"),
    [
        (0.308, 0.296, 1, False),
        (0.45, 0.0, 1, False),
        (0.45, 0.0, 3, True),
        (0.45, 0.2, 3, False),
        (0.7, 0.4, 1, False),
        (0.7, 0.29, 1, True),
    ],
)
def test_a_faint_rest_is_not_filled_up_with_effects(
    monkeypatch: pytest.MonkeyPatch, before: float, after: float, count: int, taken: bool
) -> None:
    z = np.zeros(1)
    one = SimpleNamespace(names=("a",), prior=0.0, z=z)
    two = SimpleNamespace(names=("a", "b"), prior=0.0, z=z)
    monkeypatch.setattr("diagnosis.fits.search.count", lambda _: count)
    monkeypatch.setattr(worth, "strained", lambda _: False)
    monkeypatch.setattr(worth, "is_gap", lambda fit: fit is one or after > 0.1)
    left = {one.names: before, two.names: after}
    monkeypatch.setattr("diagnosis.fits.search.remaining", lambda fit: left[fit.names])
    monkeypatch.setattr("diagnosis.fits.search.leaves", lambda fit, _: fit is one)
    monkeypatch.setattr("diagnosis.fits.search.model_error", lambda _: 0.0)
    monkeypatch.setattr("diagnosis.fits.search.excess", lambda fit: 1e3 * left[fit.names] ** 4)
    monkeypatch.setattr(candidates, "best_laws", lambda *_: [two])
    monkeypatch.setattr(candidates, "without", lambda *_: one)
    assert with_weaker(one, None) is (two if taken else one)  # type: ignore[arg-type, comparison-overlap]


@pytest.mark.parametrize(
    ("whole", "left", "looked"), [(6.0, 4.0, True), (4.5, 4.0, False), (120.0, 40.0, False)]
)
def test_small_effects_are_looked_for_beside_one_that_explains_as_much_as_each_of_them_must(
    whole: float, left: float, looked: bool
) -> None:
    chosen = replace(fit("", off=left), values={"column.stiffness": {"factor": 1.1}})
    assert may_lack(fit("", off=whole), chosen) is looked


def test_an_effect_that_came_before_is_exchanged_beside_one_that_it_stood_in_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    one, wrong, right = fit("a"), fit("ab"), fit("bc")
    left = {one.names: 4.0, wrong.names: 0.475, right.names: 0.0}
    monkeypatch.setattr("diagnosis.fits.search.remaining", lambda item: left[item.names])
    monkeypatch.setattr("diagnosis.fits.search.leaves", lambda item, _: left[item.names] > 0.0)
    monkeypatch.setattr("diagnosis.fits.search.model_error", lambda _: 0.0)
    monkeypatch.setattr("diagnosis.fits.search.excess", lambda item: 1e3 * left[item.names])
    monkeypatch.setattr(candidates, "best_laws", lambda item, _: [wrong] if item is one else [])
    monkeypatch.setattr(candidates, "exchanged", lambda *_: right)
    monkeypatch.setattr(candidates, "without", lambda *_: one)
    assert with_weaker(one, None) is right  # type: ignore[arg-type]


@pytest.mark.parametrize(("z", "after", "taken"), [(3.3, 0.4, True), (2.4, 0.4, False), (3.3, 2.9, False)])
def test_two_effects_take_the_place_of_one_where_they_bring_nominal_parameters_back(
    monkeypatch: pytest.MonkeyPatch, z: float, after: float, taken: bool
) -> None:
    chosen, rival, two = fit("ab", z), fit("ac", 5.0, 1.0), fit("acd", after)
    monkeypatch.setattr(candidates, "extended", lambda *_, **__: [two])
    monkeypatch.setattr(worth, "is_gap", lambda _: False)
    assert trade.two_for_one(chosen, [rival], None, 6) is (two if taken else chosen)  # type: ignore[arg-type]


def test_hypotheses_that_err_in_withheld_seconds_only_are_told_apart_by_fits_to_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    held = np.where(DATA.train, 0.0, 0.5)[:, None]
    chosen, rival, other = fit("a"), fit("b", 0.0, held), fit("c", 0.0, 0.5)
    assert not trade.tied(chosen, rival)
    better = {("a",): fit("a"), ("b",): fit("b", 0.0, 1e-3)}
    monkeypatch.setattr(fitting, "fit", lambda _data, values, *_, **__: better[tuple(values)])
    monkeypatch.setattr(fitting, "at", lambda _data, values, _z: better[tuple(values)])
    best, (moved, still) = trade.on_all(chosen, [rival, other])
    assert trade.tied(best, moved)
    assert still is other
    better["b",] = replace(better["b",], reduced=NOISY + 0.5)  # further away once more is seen
    assert trade.on_all(chosen, [rival, other]) == (chosen, [rival, other])


@pytest.mark.long
def test_an_effect_without_which_nothing_is_left_either_is_not_needed(cases: Cases) -> None:
    late: Values = {"actuator.delay": {"delay": 0.004}}
    data = residuals.prepare(lab_a(whole := cases.record(late, duration=8.0)), whole)
    both = fitting.fit(data, late | {"sensor.column_force.gain": {"factor": 1.001}})
    assert needed(both, worth.SEEN).names == ("actuator.delay",)


@pytest.mark.long
def test_a_table_that_is_late_and_slow_is_both_and_no_feed_forward_with_play(
    cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    true = {"table.bandwidth": {"factor": 0.5}, "table.delay": {"delay": 0.005}}
    whole = cases.record(true, duration=8.0)
    data = residuals.prepare(lab_b(whole), whole)
    bare = fitting.fit(data, {})
    first = [fitting.fit(data, {name: values}, bare.z) for name, values in true.items()]
    effects = {"table.feed_forward": {"velocity": -0.5}, "table.backlash": {"width": 1e-5}}
    values = {name: data.catalogue[name].values(given) for name, given in effects.items()}
    monkeypatch.setattr(trade, "leaves", lambda _: False)
    stands = fitting.fit(data, values, bare.z)
    found = trade.of_the_plan(bare, stands, first)
    best = min(found, key=lambda item: item.cost)
    assert best.cost < stands.cost
    assert best.values["table.bandwidth"]["factor"] == pytest.approx(0.5, rel=0.1)
    assert best.values["table.delay"]["delay"] == pytest.approx(0.005, rel=0.2)
    assert trade.of_the_plan(bare, best, first) == []  # there they are already
    other = {"sensor.damper_stroke.gain": {"factor": 1.1}}
    assert trade.of_the_plan(bare, fitting.at(data, values | other, bare.z), first) == []
