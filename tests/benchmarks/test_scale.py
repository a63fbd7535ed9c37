"""The curves over storeys and tick rate: their buildings."""

from __future__ import annotations

import pytest

from benchmarks import scale
from common.plan.plan import Plan


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
