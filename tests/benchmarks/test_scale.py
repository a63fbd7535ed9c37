"""The buildings of the benchmark over the number of storeys and the tick rate."""

from __future__ import annotations

import pytest

from benchmarks import scale
from common.plan.plan import Plan


def test_a_uniform_building_of_one_storey_equals_the_default_building() -> None:
    structure, default = scale.uniform(1).structure, Plan().structure
    assert structure.mass == default.mass
    assert structure.stiffness == pytest.approx(default.stiffness)
    assert structure.damping == pytest.approx(default.damping)


@pytest.mark.parametrize("storeys", [1, 3, 20])
def test_a_uniform_buildings_first_frequency_agrees_with_the_closed_form(storeys: int) -> None:
    assert scale.frequency_error(storeys) < scale.SAME


def test_the_closed_form_for_two_storeys_agrees_with_the_textbook() -> None:
    assert scale.first_frequency(2) ** 2 == pytest.approx((3.0 - 5.0**0.5) / 2.0)
