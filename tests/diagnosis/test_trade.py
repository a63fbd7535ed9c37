"""One effect in place of two, or two in place of one: which description of a part is chosen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.findings.certainty.other_causes import described
from diagnosis.fits import candidates, fitting, search, trade, worth
from diagnosis.fits.fitting import TIED, Fit
from diagnosis.fits.laws import best
from diagnosis.fits.search import Search, plainest
from diagnosis.fits.trade import foremost, parted, simplest, tied
from laboratories.effects import CATALOGUE
from models.registry import Array
from tests.diagnosis.test_equivalents import DATA, NOISY

FRICTION = CATALOGUE["damper.friction"]
COULOMB = {"force": 20.0, "velocity": 1e-6}
SIDED = {"damper.friction": FRICTION.under(1, COULOMB)}
VALUE = {"damper.mass": {"factor": 1.1}}
PAIR = {"damper.friction": COULOMB, "sensor.column_force.bias": {"offset": 3.0}}


def fit(values: dict[str, dict[str, float]], off: Array | float = 0.0) -> Fit:
    return Fit(DATA, values, np.zeros(0), NOISY + off)


def test_if_two_descriptions_predict_the_same_the_one_with_fewer_free_parameters_is_chosen() -> None:
    one, two = fit(SIDED), fit(PAIR, 1e-4)
    for both in ([one, two], [two, one]):
        assert simplest(both) == (two, (one,))


def test_a_description_that_fits_better_is_chosen_whatever_its_number_of_parameters() -> None:
    one, two = fit(SIDED), fit(PAIR, 0.2)
    assert simplest([two, one]) == (one, ())


def test_of_fits_that_the_data_cannot_tell_from_the_best_the_search_goes_on_with_the_simplest() -> None:
    best, simple, worse = fit(SIDED), fit(PAIR, 1e-4), fit({"damper.friction": COULOMB}, 0.2)
    assert foremost([best, simple, worse]) is simple


@pytest.mark.parametrize(
    ("moved", "error", "same"), [(0.1, 1.0, True), (0.1, 0.05, False), (0.13, 1.0, False), (-0.1, 1.0, True)]
)
def test_a_law_in_the_place_of_a_value_must_do_more_than_formulas_differ_by_and_than_anybody_could_see(
    monkeypatch: pytest.MonkeyPatch, moved: float, error: float, same: bool
) -> None:
    monkeypatch.setattr(trade, "model_error", lambda item: np.full(item.data.sigma.size, 4.0 * error))
    step = moved * np.sqrt(DATA.group)
    two, one, law = fit(SIDED), fit(VALUE, step), fit({"damper.friction": COULOMB}, step)
    assert not tied(two, one)
    assert not trade.plainer(law, two)
    assert trade.plainer(one, two) is same
    assert not trade.plainer(two, one)
    assert simplest([two, one])[0] is (one if same else min([one, two], key=lambda item: item.cost))


def test_half_of_an_effect_lies_between_none_and_all_of_it() -> None:
    values = {"table.delay": {"delay": 0.006}, "table.bandwidth": {"factor": 0.5}}
    assert trade.half(fit(values)) == {"table.delay": {"delay": 0.003}, "table.bandwidth": {"factor": 0.75}}


def test_fits_with_equal_costs_and_different_residuals_are_not_tied() -> None:
    miss = np.where(np.arange(DATA.groups)[:, None] % 2, 1.0, -1.0)
    one, two = (fit(PAIR, sign * miss - NOISY) for sign in (1.0, -1.0))
    assert one.cost == two.cost
    assert not tied(one, two)


def test_a_description_is_written_with_its_laws() -> None:
    assert described(fit(SIDED)) == "damper.friction (law by direction and speed)"
    assert described(fit(PAIR)) == "damper.friction with sensor.column_force.bias"


def test_a_fit_that_has_not_reached_its_end_is_moved_on_before_two_effects_are_held_against_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    far, ended, two = fit(SIDED, 0.5), fit(SIDED), fit(PAIR, 1e-4)
    monkeypatch.setattr(
        fitting, "fit", lambda _, values, __: ended if "asymmetry" in values["damper.friction"] else far
    )
    monkeypatch.setattr(candidates, "extended", lambda *_, **__: [two])
    assert parted(far, far, None) == [ended, two]  # type: ignore[arg-type]
    assert parted(far, ended, None) == [two]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("strained", "whole", "taken"), [(True, 3.0, True), (True, 0.55, False), (False, 3.0, False)]
)
def test_an_effect_that_explains_most_and_strains_nominal_parameters_is_held_against_all_others_afresh(
    monkeypatch: pytest.MonkeyPatch, strained: bool, whole: float, taken: bool
) -> None:
    bare, chosen, other = fit({}, whole), fit({"damper.friction": COULOMB}, 0.5), fit(SIDED)
    monkeypatch.setattr(worth, "is_gap", lambda item: strained and item is chosen)
    monkeypatch.setattr(trade, "afresh", lambda *_: [other])
    for name in ("parted", "paired", "released"):
        monkeypatch.setattr(trade, name, lambda *_: [])
    assert trade.traded(bare, chosen, [], None, 3)[0] is (other if taken else chosen)  # type: ignore[arg-type]


def test_another_law_with_as_many_parameters_must_fit_better_and_one_with_more_much_better() -> None:
    play = CATALOGUE["actuator.backlash"]
    dry, before, greased = (fit({play.name: play.under(law, {"width": 1e-4})}) for law in range(3))

    def costing(law: Fit, cost: float) -> Fit:
        return replace(law, z=np.array([np.sqrt(cost)]))

    first, near, far = costing(dry, 16.0), costing(before, 15.0 - TIED + 2.0), costing(before, 15.0 - TIED)
    assert not best.whole(first)  # leaves nothing that is seen, but has a parameter four tolerances off
    assert best.whole(far)
    assert best.simplest(first, [near]) is first
    assert best.simplest(first, [far]) is far
    assert best.simplest(first, [costing(greased, 15.0 - TIED)]) is first


@pytest.mark.parametrize(("prior", "stands"), [(4.0, "damper.mass"), (6.0, "sensor.column_force.gain")])
def test_of_effects_that_the_data_cannot_tell_apart_one_that_strains_nominal_parameters_stands_behind(
    prior: float, stands: str
) -> None:
    """A machine's effect else stands before a sensor's; chance takes 3.84 of Σ z²."""
    machine = replace(fit(VALUE), z=np.array([np.sqrt(prior)]))
    sensor = replace(fit({"sensor.column_force.gain": {"factor": 1.1}}), z=np.array([1.0]))
    for chosen, other in ((machine, sensor), (sensor, machine)):
        found = plainest(Search(DATA, fit({}, 9.0), chosen, (other,)))
        assert found.chosen.names == (stands,)
        assert len(found.alternatives) == 1


@pytest.mark.parametrize("name", ["column.yielding", "column.self_centring"])
def test_a_law_whose_loop_is_least_is_another_one(name: str) -> None:
    effect = DATA.catalogue[name]
    loop = next(item for item in effect.every if item.defining)
    law = next(number for number, one in enumerate(effect.laws) if "loop" in one.shapes) if effect.laws else 0
    given = {item.name: item.sizes[0] if item.sizes else item.null for item in effect.parameters}

    def with_loop(size: float) -> Fit:
        values = effect.under(law, given) if effect.laws else effect.values(given)
        return fit({name: values | {"loop": size}})

    assert fitting.at_end(with_loop(loop.least)) == (name,)
    assert fitting.at_end(with_loop(2.0 * loop.least)) == ()
    assert fitting.at_end(with_loop(loop.most)) == ()


@pytest.mark.parametrize(("ended", "stands"), [(False, "damper.mass"), (True, "sensor.column_force.gain")])
def test_of_effects_that_the_data_cannot_tell_apart_one_at_the_end_of_its_range_stands_behind(
    ended: bool, stands: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        fitting, "at_end", lambda item: item.names if ended and item.names == ("damper.mass",) else ()
    )
    mass, gain = fit(VALUE), fit({"sensor.column_force.gain": {"factor": 1.1}}, 1e-4)
    found = plainest(Search(DATA, fit({}), gain, (mass,)))
    assert found.chosen.names == (stands,)


def test_of_effects_that_the_data_cannot_tell_apart_a_value_of_the_plan_stands_before_a_law() -> None:
    value, law = fit(VALUE), fit({"damper.asymmetry": {"share": 0.1}}, -1e-5)
    assert law.cost < value.cost
    assert plainest(Search(DATA, fit({}, 9.0), law, (value,))).chosen is value


@pytest.mark.parametrize(("left", "stands"), [(0.1, True), (0.13, False)])
def test_a_far_likelier_fit_stands_unless_it_is_seen_to_leave_more(
    monkeypatch: pytest.MonkeyPatch, left: float, stands: bool
) -> None:
    chosen, other = fit(SIDED, 0.5), fit(PAIR)
    one = replace(other, values={"sensor.column_force.bias": {"offset": 3.0}})
    monkeypatch.setattr(search, "remaining", lambda item: left if item is one else 0.09)
    found = search.likeliest(Search(DATA, fit({}, 9.0), chosen, (one,)))
    assert (found.chosen is one) is stands
