"""Pairs of effects: both are found, one that hides behind the other too, and one that is not there is taken away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.fits import candidates, contact, fitting, residuals, settling, trade, worth
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Values
from diagnosis.fits.noise import sensor_noise
from diagnosis.fits.search import fewest, pruned
from diagnosis.signals.noise import colour
from diagnosis.signals.noise.model import NoiseModel
from models.registry import Array
from tests.diagnosis.cases import STRONGEST, Cases, Effects, estimate, lab_b, named
from tests.diagnosis.test_equivalents import DATA, NOISY

LOUDER: Effects = {
    "damper.stroke_stop": {"stroke": 0.04, "stiffness": 2000.0},
    "damper.gain": {"factor": 1.1},
}


def fit(values: Values, z: float = 0.0, off: Array | float = 0.0) -> Fit:
    return Fit(DATA, values, np.full(1, z), NOISY + off)


@pytest.mark.parametrize(("density", "white"), [(0.25, 0.5), (4.0, 1.0), (None, 1.0)])
def test_white_noise_in_the_place_of_coloured_noise_is_no_louder_than_averages(
    monkeypatch: pytest.MonkeyPatch, density: float | None, white: float
) -> None:
    over = None if density is None else np.full(colour.GRID.size, density)
    data = replace(DATA, white=np.ones(1), noise=(NoiseModel(1.0, density=over),))
    monkeypatch.setattr(sensor_noise, "remodelled", lambda _: data)
    monkeypatch.setattr(sensor_noise, "whitened", lambda _: data)
    flat = sensor_noise.flattened(fit({}))
    assert flat.noise == ()
    assert flat.white == pytest.approx([white])


@pytest.mark.parametrize(
    ("larger", "left", "taken"), [(False, False, True), (False, True, False), (True, True, True)]
)
def test_a_rest_within_the_error_of_a_model_is_an_effect_only_where_nothing_of_it_is_left(
    monkeypatch: pytest.MonkeyPatch, larger: bool, left: bool, taken: bool
) -> None:
    one, two = fit({"a": {}}), fit({"a": {}, "b": {}})

    def leaves(item: Fit, allowed: Array | None = None) -> bool:
        return larger if allowed is not None else left or item.names == one.names

    monkeypatch.setattr(settling, "leaves", leaves)
    monkeypatch.setattr(settling, "far_likelier_ones", lambda *_: (one, [two]))
    monkeypatch.setattr(settling, "in_white_noise", lambda *_: [])
    monkeypatch.setattr(settling, "changes", lambda _: [])
    monkeypatch.setattr(sensor_noise, "coloured", lambda _: True)
    monkeypatch.setattr(sensor_noise, "whitened", lambda item: item.data)
    monkeypatch.setattr(fitting, "polished", lambda item: item)
    monkeypatch.setattr(fitting, "at", lambda _data, values, _z: one if values == one.values else two)
    assert settling.beside_colour(one, None) is (two if taken else None)  # type: ignore[arg-type]


def test_effects_that_are_as_good_take_over_the_law_of_the_one_beside_the_best(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def pair(other: str, law: float, off: float) -> Fit:
        return fit({"a": {"law": law}, other: {}}, off=off)

    best, level, worse = pair("b", 0.0, 0.0), pair("c", 0.0, 1e-4), pair("d", 0.0, 1.0)
    monkeypatch.setattr(candidates, "in_best_laws", lambda fits, **_: fits)
    monkeypatch.setattr(fitting, "fit", lambda _data, values, _z: fit(values))
    for law, follows in ((3.0, 3.0), (0.0, 0.0)):
        monkeypatch.setattr(candidates, "in_other_laws", lambda _, law=law: pair("b", law, -0.1))
        found = candidates.under_further_laws([best, level, worse])
        assert [item.names[-1] for item in found] == ["b", "c", "d"]
        assert [item.values["a"]["law"] for item in found] == [law, follows, 0.0]


@pytest.mark.parametrize(("before", "after", "kept"), [(2.3, 0.3, 1), (1.8, 0.0, 0), (2.3, 1.5, 0)])
def test_an_effect_that_brings_nominal_parameters_back_is_kept_beside_a_fit_that_leaves_nothing(
    monkeypatch: pytest.MonkeyPatch, before: float, after: float, kept: int
) -> None:
    further = fit({"a": {}, "b": {}}, after)
    monkeypatch.setattr(candidates, "extended", lambda *_, **__: [further])
    assert len(trade.released(fit({"a": {}}, before), None)) == kept  # type: ignore[arg-type]


@pytest.mark.parametrize(("z", "names"), [(2.9, ("a",)), (3.0, ("a", "b"))])
def test_a_simpler_description_stands_unless_it_moves_a_nominal_parameter_too_far(
    monkeypatch: pytest.MonkeyPatch, z: float, names: tuple[str, ...]
) -> None:
    monkeypatch.setattr(trade, "freedom", lambda item: (len(item.names), len(item.names)))
    stands, others = trade.simplest([fit({"a": {}}, z), fit({"a": {}, "b": {}}, 1.4)])
    assert stands.names == names
    assert len(others) == 1


@pytest.mark.long
def test_what_an_impact_makes_vague_counts_less_than_what_shows_before_it(cases: Cases) -> None:
    whole = cases.record(LOUDER, duration=4.0)
    data, nominal = residuals.prepare(lab_b(whole), whole), np.zeros(7)
    stop = fitting.at(data, {"damper.stroke_stop": {"stroke": 0.0402, "stiffness": 2000.0}}, nominal)
    known = contact.vaguer(stop)
    assert known is not None
    assert known.cost < stop.cost
    vague = known.data.vague
    assert vague is not None
    place = data.part.signals.index("damper_stroke")
    stroke = np.abs(data.part.measured[: data.groups * data.group, place])
    met = int(np.argmax(stroke > 0.04)) // data.group
    assert np.all(vague[: met - 1] == 1.0)
    assert np.all(np.diff(vague, axis=0) >= 0.0)
    assert vague[-1, place] > 10.0
    assert np.all(
        vague[:, data.part.signals.index("table_displacement")] == 1.0
    )  # the stop is not the table's
    true, wrong = (
        fitting.at(known.data, stop.values | {name: {"factor": 1.1}}, nominal)
        for name in ("damper.gain", "sensor.damper_force.gain")
    )
    assert true.cost < wrong.cost
    assert contact.vaguer(known) is None
    assert residuals.by_tick(known.data).vague is None


@pytest.mark.parametrize(
    ("name", "likely", "kept"),
    [
        ("sensor.damper_stroke.drift", True, True),
        ("sensor.damper_stroke.drift", False, False),
        ("damper.stiffness", True, False),
    ],
)
def test_what_no_motion_causes_stays_where_coloured_noise_is_far_less_likely(
    monkeypatch: pytest.MonkeyPatch, name: str, likely: bool, kept: bool
) -> None:
    bare, both = (
        Fit(DATA, {key: {} for key in names}, np.zeros(0), NOISY) for names in ((), (name, "damper.friction"))
    )

    def without(fit: Fit, gone: str) -> Fit:
        return replace(fit, values={key: values for key, values in fit.values.items() if key != gone})

    monkeypatch.setattr(candidates, "without", without)
    monkeypatch.setattr(worth, "changes", lambda fit: [np.ones(2)] * len(fit.names))
    monkeypatch.setattr(worth, "is_worth", lambda _bare, less, _fit: "damper.friction" not in less.names)
    monkeypatch.setattr("diagnosis.fits.settling.beats_colour", lambda *_: likely)
    assert (name in pruned(bare, both).names) is kept


def test_an_effect_that_changes_nothing_goes_before_the_one_that_explains_the_gap(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    names = "damper.stiffness", "sensor.table_acceleration.bias"
    both = Fit(DATA, {name: {} for name in names}, np.zeros(0), NOISY)

    def without(fit: Fit, gone: str) -> Fit:
        return replace(fit, values={key: values for key, values in fit.values.items() if key != gone})

    monkeypatch.setattr(candidates, "without", without)
    monkeypatch.setattr(worth, "changes", lambda fit: [np.full(2, 1e6), np.full(2, 1e-3)][: len(fit.names)])
    monkeypatch.setattr("diagnosis.fits.settling.beats_colour", lambda *_: False)
    assert pruned(replace(both, values={}), both).names == names[:1]


def test_an_effect_that_gains_no_more_than_chance_is_taken_away_at_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    one, both = fit({"damper.mass": {}}, off=0.5), fit({"damper.mass": {}, "damper.stiffness": {}})
    monkeypatch.setattr(candidates, "without", lambda item, _: replace(one, reduced=item.reduced))
    monkeypatch.setattr(worth, "changes", lambda item: [np.ones(2)] * len(item.names))
    monkeypatch.setattr("diagnosis.fits.search.trimmed", lambda item: item)
    assert fewest(both).names == one.names
    monkeypatch.setattr(candidates, "without", lambda *_: one)
    assert fewest(both) is both


@pytest.mark.parametrize(("alone", "undone"), [(10.0, True), (1.0, False)])
def test_effects_undo_each_other_only_if_one_of_them_does_far_more_by_itself_as_well(
    monkeypatch: pytest.MonkeyPatch, alone: float, undone: bool
) -> None:
    """One that keeps a motion small does far more beside a law that is steep farther out than by itself."""
    does: dict[tuple[str, ...], float] = {(): 0.0, ("a",): alone, ("b",): -10.0, ("a", "b"): 1.0}
    monkeypatch.setattr(fitting, "at", lambda _, values, z: fit(dict(values), off=does[tuple(values)]))
    monkeypatch.setattr(worth, "beyond_nominal", lambda _, change: change)
    bare, both = (fitting.at(DATA, {name: {} for name in names}, np.zeros(1)) for names in ("", "ab"))
    sizes = [np.array([2.0 * worth.CANCELLED**2]), np.array([0.0])]
    assert worth.cancelling(bare, both, sizes) is undone


def test_a_change_counts_as_far_as_nominal_parameters_do_not_make_it_as_well() -> None:
    """Of a change along a parameter's slope a share of 1/(1 + slope²) is left: the ridge of its tolerance."""
    along, beside = np.zeros_like(NOISY), np.zeros_like(NOISY)
    along[::2], beside[1::2] = 0.5, 3.0
    fitted = fit({})
    fitted.__dict__["jacobian"] = along.reshape(-1, 1)
    left = worth.beyond_nominal(fitted, 4.0 * along + beside)
    share = 1.0 / (1.0 + float(np.sum(along**2)))
    np.testing.assert_allclose(left, 4.0 * share * along + beside, atol=1e-12)


def test_two_effects_in_two_laboratories_are_both_found(cases: Cases) -> None:
    report = cases.report(
        {"column.friction": {"force": 900.0}, "damper.friction": {"force": 3.0}}, duration=STRONGEST
    )
    assert named(report) == ["column.friction", "damper.friction"]
    assert estimate(report, "column.friction", "force") == pytest.approx(900.0, rel=0.05)
    assert estimate(report, "damper.friction", "force") == pytest.approx(3.0, rel=0.05)


@pytest.mark.slow
def test_two_effects_in_one_laboratory_are_both_found(cases: Cases) -> None:
    report = cases.report(
        {"actuator.backlash": {"width": 3e-4}, "column.yielding": {"yield_displacement": 1.5e-3}},
        duration=STRONGEST,
    )
    assert named(report) == ["actuator.backlash", "column.yielding"]
    assert estimate(report, "actuator.backlash", "width") == pytest.approx(3e-4, rel=0.05)


@pytest.mark.long
def test_two_values_of_a_table_are_found_where_a_law_with_more_parameters_does_what_they_do(
    cases: Cases,
) -> None:
    """An oil column in a part of the table's loop leaves nothing either, and moves three parameters."""
    report = cases.report(
        {"table.delay": {"delay": 0.008}, "table.bandwidth": {"factor": 0.65}}, duration=STRONGEST
    )
    assert named(report) == ["table.bandwidth", "table.delay"]
    assert estimate(report, "table.delay", "delay") == pytest.approx(0.008, rel=0.25)
    assert estimate(report, "table.bandwidth", "factor") == pytest.approx(0.65, rel=0.1)
