"""The curves over storeys and tick rate: their buildings, and one small point of each."""

from __future__ import annotations

import json

import pytest

from benchmarks import scale
from common.plan import Plan


def test_one_storey_is_the_default_building() -> None:
    structure, default = scale.uniform(1).structure, Plan().structure
    assert structure.mass == default.mass
    assert structure.stiffness == pytest.approx(default.stiffness)
    assert structure.damping == pytest.approx(default.damping)


@pytest.mark.parametrize("storeys", [1, 3, 20])
def test_a_uniform_building_vibrates_as_the_closed_form_has_it(storeys: int) -> None:
    assert scale.frequency_error(storeys) < scale.SAME


def test_the_closed_form_is_the_textbooks_two_storeys() -> None:
    assert scale.first_frequency(2) ** 2 == pytest.approx((3.0 - 5.0**0.5) / 2.0)


@pytest.mark.parametrize("curve", scale.CURVES, ids=lambda curve: curve.name)
def test_every_value_of_a_curve_has_a_plan_that_runs(
    curve: scale.Curve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scale, "TICKS", 20)
    monkeypatch.setattr(scale, "COMPILED_TICKS", 20)
    points = [scale.point(value, curve.plan(value), repeats=1) for value in curve.values[:2]]
    assert all(point.finite for point in points)
    figures = scale.figures(curve, points)
    json.dumps([figure._asdict() for figure in figures], allow_nan=False)
    json.dumps([point.plain(curve.name) for point in points], allow_nan=False)
