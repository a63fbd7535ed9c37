"""A mechanism that follows any of its laws is named as that mechanism, and the fit names the law."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
import pytest

from common.plan.plan import Plan
from common.roles import MASTER
from diagnosis.fits import fitting, hypothesis, residuals
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Values
from diagnosis.fits.laws import best
from diagnosis.fits.laws.afresh import afresh
from diagnosis.fits.laws.best import in_best_laws, under_the_first
from diagnosis.fits.laws.specimen import follow, path
from diagnosis.fits.laws.starts import gridded
from diagnosis.fits.laws.unlike_first import unlike_first
from diagnosis.fits.residuals import Data
from diagnosis.fits.scales import Scales
from diagnosis.fits.trade import alone, simplest
from diagnosis.recorded.column_alone import ColumnAlone
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.parts import Part
from laboratories.effects import CATALOGUE
from laboratories.effects.effect import Effect, Parameter
from models.specimens.fit import SpecimenFit, forces
from models.system import System
from tests.diagnosis.cases import STRONGEST, Cases, lab_a
from tests.diagnosis.specimens import (
    HARDENING,
    INTERVAL,
    LIMIT,
    NOISE,
    TICKS,
    Driven,
    K,
    MadeSpecimen,
    data_of,
    swelling,
)

PINCHED = {"factor": 0.4144, "hardening": 0.2474, "width": 2.7e-3}


def first_law(part: Part | None = None) -> Fit:
    values = {"yield_displacement": 1e-3, "hardening": 0.1, "exponent": 2.0}
    return fitting.fit(data_of(part or MadeSpecimen()), {"column.yielding": values})


def test_a_pinched_law_with_damage_is_found_from_force_over_deformation() -> None:
    (found,) = in_best_laws([first_law(Driven())])
    values = found.values["column.yielding"]
    effect = CATALOGUE["column.yielding"]
    assert effect.laws[int(values["law"])].name == "pinched trilinear"
    np.testing.assert_allclose(values["yield_displacement"], LIMIT, rtol=0.03)
    for name, true in Driven.TRUE.items():
        np.testing.assert_allclose(values[name], true, atol=0.05)
    assert found.chi < 1.2 * found.reduced.size


def test_a_model_that_takes_long_is_fitted_where_others_leave_much(monkeypatch: pytest.MonkeyPatch) -> None:
    left = {"bilinear": 0.02, "clough": 0.2, "layered": 0.1}
    asked: list[str] = []

    def following(model: str, *_way: bytes) -> SpecimenFit:
        asked.append(model)
        return SpecimenFit(model, {}, left[model], {})

    monkeypatch.setattr("diagnosis.fits.laws.specimen.following", following)
    part, way = Driven(), (np.ones(2), np.ones(2))
    assert follow(part, way, left).keys() == {"bilinear", "clough"}
    assert sorted(asked) == ["bilinear", "clough"]
    del left["bilinear"]
    assert follow(part, way, left).keys() == {"clough", "layered"}
    assert follow(MadeSpecimen(), way, left).keys() == {
        "clough"
    }  # a laboratory, or what is no column by itself
    left["layered"] = 0.17  # about as much as the other one
    assert follow(part, way, left).keys() == {"clough"}


@pytest.mark.slow
def test_reinforced_concrete_is_found_by_its_layers() -> None:
    part = Driven()
    true = {"axial": 0.5, "concrete": 4.0, "spalling": 0.1, "hardening": -0.01}
    force = forces("layered", {"stiffness": K, "yield_displacement": LIMIT, **true}, part.inputs)
    part.measured = (force + NOISE * np.random.default_rng(3).standard_normal(TICKS))[:, None]
    (found,) = in_best_laws([first_law(part)])
    values = found.values["column.yielding"]
    assert CATALOGUE["column.yielding"].laws[int(values["law"])].name == "layers of concrete and bars"
    np.testing.assert_allclose(values["axial"], 0.5, atol=0.1)
    assert found.chi < 1.2 * found.reduced.size


class Endochronic(Driven):
    """A column alone that is endochronic, its force in steps of a thousandth of the motion's peak and less."""

    def __init__(self) -> None:
        super().__init__()
        z, before, force = 0.0, 0.0, np.empty(TICKS)
        for tick, x in enumerate(self.inputs):
            for way in np.diff(np.linspace(before, x, 21)):
                z += way - abs(way) * z / LIMIT
            force[tick], before = K * (0.2 * x + 0.8 * z), x
        self.measured = (force + NOISE * np.random.default_rng(2).standard_normal(TICKS))[:, None]


@pytest.mark.long
def test_an_endochronic_column_is_yielding_by_that_law() -> None:
    (found,) = in_best_laws([first_law(Endochronic())])
    values = found.values["column.yielding"]
    assert CATALOGUE["column.yielding"].laws[int(values["law"])].name == "endochronic"
    assert values["loop"] == pytest.approx(1.0, abs=0.03)
    assert values["yield_displacement"] == pytest.approx(LIMIT, rel=0.03)
    assert found.chi < 1.2 * found.reduced.size


class Degrading(Driven):
    """A column alone that degrades and pinches, by Euler steps of a five-hundredth of the way between two ticks."""

    def __init__(self) -> None:
        super().__init__()
        z, energy, before, force = 0.0, 0.0, 0.0, np.empty(TICKS)
        for tick, x in enumerate(self.inputs):
            way = (x - before) / 500.0 / LIMIT
            for _ in range(500):
                nu, eta = 1.0 + 0.05 * energy, 1.0 + 0.1 * energy
                depth = 0.8 * (1.0 - math.exp(-0.3 * energy))
                width = 0.25 * (0.2 + depth)
                pinch = 1.0 - depth * math.exp(-(((z * np.sign(way) - 0.2 / nu) / width) ** 2))
                change = way * pinch * (1.0 - nu * abs(z) * (0.4 + 0.6 * np.sign(z * way))) / eta
                z, energy = z + change, energy + 0.97 * z * way
            force[tick], before = K * (0.03 * x + 0.97 * LIMIT * z), x
        self.measured = (force + NOISE * np.random.default_rng(4).standard_normal(TICKS))[:, None]


@pytest.mark.long
def test_a_column_that_degrades_and_pinches_smoothly_is_yielding_by_that_law() -> None:
    (found,) = in_best_laws([first_law(Degrading())])
    values = found.values["column.yielding"]
    assert CATALOGUE["column.yielding"].laws[int(values["law"])].model == "bwbn"
    assert values["yield_displacement"] == pytest.approx(LIMIT, rel=0.05)
    assert found.chi < 1.3 * found.reduced.size


def test_the_recording_with_the_largest_deformation_starts_the_fit_of_a_law() -> None:
    near, far = Driven(), Driven()
    near.inputs = 0.5 * near.inputs
    found = path(JoinedPart([near, far]))
    assert found is not None
    np.testing.assert_array_equal(found[0], far.inputs)
    assert path(MadeSpecimen()) is None


@pytest.mark.long
def test_the_right_law_is_selected_with_the_columns_parameters() -> None:
    before = first_law()
    (found,) = in_best_laws([before])
    values = found.values["column.yielding"]
    effect = CATALOGUE["column.yielding"]
    assert found.names == before.names
    assert effect.laws[int(values["law"])].name == "bilinear"
    np.testing.assert_allclose(values["yield_displacement"], LIMIT, rtol=0.01)
    np.testing.assert_allclose(values["hardening"], HARDENING, atol=0.01)
    assert fitting.excess(found) < 0.5 * fitting.excess(before)


def test_a_parameter_that_a_law_lacks_is_not_fitted() -> None:
    effect = CATALOGUE["column.yielding"]
    base = {"yield_displacement": 1e-3, "hardening": 0.1, "exponent": 2.0}
    names = {
        place: {item.parameter.name for item in hypothesis.free(effect, effect.under(place, base))}
        for place in range(len(effect.laws))
    }
    assert names == {
        0: {"yield_displacement", "hardening", "exponent"},
        1: {"yield_displacement", "hardening"},
        2: {"yield_displacement", "hardening", "exponent"},
        3: {"yield_displacement", "hardening", "unloading"},
        4: {"yield_displacement", "hardening", "first_bend", "second_stiffness"},
        **{
            place: {"yield_displacement", *Driven.TRUE} - {"first_bend", "second_stiffness"}
            for place in (5, 7, 9)
        },
        **{place: {"yield_displacement", *Driven.TRUE} for place in (6, 8, 10)},
        11: {"yield_displacement", "hardening", "exponent"}
        | {"concrete", "axial", "strength", "spalling", "shaft", "focus"}
        | {"core", "friction", "eccentricity", "uncracked"},
        12: {"yield_displacement", "hardening", "exponent", "loop"},
        13: {"yield_displacement", "hardening", "exponent", "loop", "strength_loss", "stiffness_loss"}
        | {f"pinch_{name}" for name in ("depth", "place", "rate", "width", "spread")},
    }


class Cracked(ColumnAlone):
    """A column alone whose force is low around the origin, by a bell that no law of the catalogue is."""

    def __init__(self) -> None:
        self.signals, self.nuisances = ("column_force",), ()
        self.candidates = tuple(CATALOGUE[f"column.{name}"] for name in ("pinching", "stiffness"))
        self.role = MASTER
        self.inputs = swelling()
        weight = 1.0 / np.cosh(self.inputs / 0.5e-3)
        force = K * self.inputs * (1.0 - 0.3 * weight + 0.2 * (1.0 - weight))
        self.measured = (force + NOISE * np.random.default_rng(4).standard_normal(TICKS))[:, None]
        self.present = np.ones((TICKS, 1), dtype=bool)


class Bent(Cracked):
    """A column alone that is elastic and loses half of its stiffness beyond 1.5 mm."""

    def __init__(self) -> None:
        super().__init__()
        self.candidates = (CATALOGUE["column.hardening"],)
        beyond = self.inputs - np.clip(self.inputs, -1.5e-3, 1.5e-3)
        self.measured = K * (self.inputs - 0.5 * beyond)[:, None]


class Sizes(Scales):
    """The sizes of the catalogue, without a record to scale them by."""

    def __init__(self) -> None:
        pass

    def sizes(self, effect: Effect, parameter: Parameter) -> list[float]:
        return list(parameter.sizes)


def test_a_law_behind_the_first_starts_on_the_side_that_promises() -> None:
    bare = fitting.fit(data_of(Bent()), {})
    best = unlike_first(bare, Sizes())[0]
    assert best.effect.laws[int(best.values["law"])].name == "with a bend"
    assert best.values["share"] < 0.0
    assert fitting.at(bare.data, {best.effect.name: best.values}, bare.z).cost < bare.cost


class Stiffening(Cracked):
    """A column alone with cracks that close within a tenth of its motion, and that is stiffer beyond."""

    TRUE: ClassVar = {"factor": 0.15, "hardening": 0.25, "width": 0.00025}

    def __init__(self) -> None:
        super().__init__()
        self.candidates = (CATALOGUE["column.hardening"], CATALOGUE["column.pinching"])
        bell = np.exp(-np.square(self.inputs / self.TRUE["width"]))
        share = 1.0 - self.TRUE["factor"] * bell + self.TRUE["hardening"] * (1.0 - bell)
        noise = NOISE * np.random.default_rng(4).standard_normal(TICKS)
        self.measured = (K * self.inputs * share + noise)[:, None]


def test_an_effect_that_promised_nothing_takes_the_place_of_one_that_follows_it_closely() -> None:
    hardening = CATALOGUE["column.hardening"]
    near = {"share": 0.3, "bend": 2e-4, "second_share": -0.1, "second_bend": 6e-4}
    chosen = fitting.fit(data_of(Stiffening()), {hardening.name: hardening.under(2, {"share": 0.3}) | near})
    assert_pinching(afresh(chosen, Sizes())[0])


def test_a_shape_that_did_nothing_where_a_fit_began_is_found_from_elsewhere() -> None:
    without = {name: value for name, value in Stiffening.TRUE.items() if name != "hardening"}
    chosen = fitting.fit(data_of(Stiffening()), {"column.pinching": {**without, "hardening": 0.0}})
    assert chosen.values["column.pinching"]["hardening"] == 0.0
    assert_pinching(afresh(chosen, Sizes())[0])


def assert_pinching(best: Fit) -> None:
    assert best.names == ("column.pinching",)
    for name, true in Stiffening.TRUE.items():
        assert best.values["column.pinching"][name] == pytest.approx(true, rel=0.1)


class HardlyRubbing(Cracked):
    """A column alone that is elastic, with Coulomb friction of less than half of the weakest start of a search."""

    FORCE = 10.0

    def __init__(self) -> None:
        super().__init__()
        self.candidates = (CATALOGUE["column.friction"],)
        rubbing = self.FORCE * np.sign(np.gradient(self.inputs))
        self.measured = (K * self.inputs + rubbing)[:, None]


def test_a_law_behind_the_first_starts_as_weak_as_its_effect_is() -> None:
    bare = fitting.fit(data_of(HardlyRubbing()), {})
    best = unlike_first(bare, Sizes())[0]
    assert best.values["force"] == pytest.approx(HardlyRubbing.FORCE, rel=0.5)


def test_starts_are_compared_over_a_beginning_where_that_is_a_small_part(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bare, at, seen = fitting.fit(data_of(HardlyRubbing()), {}), fitting.at, [0]

    def counted(data: Data, *given: Any) -> Fit:
        seen[-1] += data.groups
        return at(data, *given)

    monkeypatch.setattr(fitting, "at", counted)
    whole = unlike_first(bare, Sizes())  # a beginning lasts 6 s at least, of 8
    seen.append(0)
    monkeypatch.setattr(fitting, "SHORTEST", 1.0)
    brief = unlike_first(bare, Sizes())
    assert brief[0].gain == pytest.approx(whole[0].gain, rel=1e-3)
    assert brief[0].values["force"] == pytest.approx(whole[0].values["force"], rel=1e-3)
    assert seen[1] < 0.7 * seen[0]


def test_a_limit_that_is_neared_gradually_is_looked_for_far_above_what_is_reached() -> None:
    effect, bare = CATALOGUE["damper.force_limit"], fitting.fit(data_of(Bent()), {})
    levels = [values["force"] for values in gridded(bare, effect, 1, Sizes())]
    assert max(levels) > 3.0 * max(effect.parameters[0].sizes)


def cracked(values: Values) -> Fit:
    group, train = residuals.withheld(TICKS, INTERVAL)
    level = np.array([NOISE])
    data = Data(Cracked(), System(Plan()), level, level, group, train, np.zeros(1))
    return fitting.fit(data, values, rounds=3)


def test_cracks_that_close_by_an_unknown_bell_are_pinching_with_tails() -> None:
    first = {"factor": 0.3, "width": 0.001, "hardening": 0.1}
    (found,) = in_best_laws([cracked({"column.pinching": first})])
    values = found.values["column.pinching"]
    assert CATALOGUE["column.pinching"].laws[int(values["law"])].name == "with tails"
    np.testing.assert_allclose(values["factor"], 0.3, atol=0.06)
    np.testing.assert_allclose(values["hardening"], 0.2, atol=0.06)
    assert found.chi < 1.2 * found.reduced.size


def test_an_effect_whose_left_out_shape_does_what_a_second_effect_does_stands_alone() -> None:
    pinching = {"factor": 0.4, "width": 0.5e-3, "hardening": 0.0, "tails": 2.0, "law": 1.0}
    both = cracked({"column.pinching": pinching, "column.stiffness": {"factor": 1.2}})
    (one,) = alone(both)
    assert one.names == ("column.pinching",)
    assert simplest([both, one])[0] is one


@pytest.mark.parametrize(("tails", "first"), [(None, True), (0.5, False)])
def test_a_law_that_is_nearly_the_first_one_leads_back_to_it(
    tails: float | None, first: bool, cases: Cases
) -> None:
    own = {} if tails is None else {"tails": tails, "law": 1.0}
    whole = cases.record({"column.pinching": PINCHED | own}, duration=STRONGEST)
    data = residuals.prepare(lab_a(whole), whole)
    begun = PINCHED | {"tails": 20.0 if tails is None else tails, "law": 1.0}
    led = under_the_first(fitting.fit(data, {"column.pinching": begun}))
    assert ("law" not in led.values["column.pinching"]) is first
    assert led.chi < 1.2 * led.reduced.size


def test_the_search_leads_back_to_the_first_law(cases: Cases, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = cases.record({"column.pinching": PINCHED}, duration=STRONGEST)
    data = residuals.prepare(lab_a(whole), whole)
    with_tails = fitting.at(
        data, {"column.pinching": PINCHED | {"tails": 20.0, "law": 1.0}}, np.zeros(len(data.part.nuisances))
    )
    monkeypatch.setattr(best, "whole", lambda _: False)
    monkeypatch.setattr(best, "raced", lambda *_, **__: {})
    (found,) = in_best_laws([with_tails])
    assert "law" not in found.values["column.pinching"]
