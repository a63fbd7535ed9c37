"""Effects under laws that no first law of the catalogue is like, in the place of one that does nearly the same."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.fits import fitting, residuals, trade
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Values
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import search
from laboratories.effects import CATALOGUE
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_b
from tests.diagnosis.test_equivalents import DATA, NOISY

STOP, SPRING = "damper.stroke_stop", "damper.stiffness"


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "hidden"),
    [
        (SPRING, {"factor": 1.01, "law": 1.0, "stiffening": 25.0}),
        ("damper.viscous", {"factor": 1.1, "law": 1.0, "exponent": 1.5}),
        ("table.velocity_limit", {"velocity": 0.12, "law": 1.0, "sharpness": 4.0}),
    ],
)
def test_a_law_that_bends_is_named_with_its_shape(name: str, hidden: dict[str, float], cases: Cases) -> None:
    whole = cases.record({name: hidden}, duration=8.0)
    found = search(residuals.prepare(lab_b(whole), whole), Scales(whole)).chosen
    assert found.names == (name,)
    for parameter, value in hidden.items():
        assert found.values[name][parameter] == pytest.approx(value, rel=0.15)


def test_a_spring_that_lets_the_mass_go_leaves_far_residuals_and_no_warning(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    data = residuals.prepare(lab_b(whole), whole)
    for stiffening in (-400.0, -4e5):
        system = CATALOGUE[SPRING].apply(data.system, factor=1.0, law=1.0, stiffening=stiffening)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            reduced = data.reduced(system)
        assert np.all(np.isfinite(reduced))
    assert np.max(np.abs(reduced)) == pytest.approx(residuals.FAR)


@pytest.mark.parametrize(
    ("effects", "left", "looked"), [([STOP], True, True), ([STOP], False, False), ([STOP, "b"], True, False)]
)
def test_such_laws_are_looked_at_beside_a_single_effect_that_leaves_something(
    effects: list[str], left: bool, looked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def at(_: object, values: Values, z: Array, *_more: object) -> Fit:
        return Fit(DATA, dict(values), z, NOISY if values else NOISY + 10.0)

    class Promised:
        effect, values, z = (
            replace(next(iter(DATA.catalogue.values())), name=SPRING),
            {"law": 1.0},
            np.ones(1),
        )

    monkeypatch.setattr(trade, "leaves", lambda _: left)
    monkeypatch.setattr(trade, "unlike_first", lambda *_: [Promised])
    monkeypatch.setattr(trade, "descended", lambda item: item)
    for name in ("at", "fit"):
        monkeypatch.setattr(fitting, name, at)
    monkeypatch.setattr(fitting, "begun", lambda item: item)
    chosen = at(None, {name: {} for name in effects}, np.zeros(1))
    found = trade.under_unlike(at(None, {}, np.zeros(1)), chosen, None)  # type: ignore[arg-type]
    assert [item.values for item in found] == [{SPRING: {"law": 1.0}}] * looked
