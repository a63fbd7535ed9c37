"""The plans of the benchmark."""

from __future__ import annotations

import numpy as np
import pytest

from loop.nominal import partition, preflight
from models.compensators import COMPENSATORS
from models.structures import shear_building
from validation.benchmark2020.problem import (
    CASES,
    EL_CENTRO,
    SETTINGS,
    PartitionCase,
    draw,
    planned,
    with_compensator,
    with_plant,
)

FREQUENCIES = {1: (3.59, 16.0, 38.1)}  # Hz, as published


def test_case_1_has_the_published_frequencies_and_one_damping_ratio() -> None:
    modes = shear_building.modes(*partition.matrices(planned(CASES[0], EL_CENTRO)))
    assert 1.0 / modes.periods == pytest.approx(FREQUENCIES[1], rel=0.007)
    assert modes.damping_ratios == pytest.approx(0.05)


def test_the_record_is_followed_by_ten_seconds_of_still_ground() -> None:
    plan = planned(CASES[1], EL_CENTRO)
    assert plan.test.duration == pytest.approx(31.18 + 10.0, abs=plan.test.interval)


def test_every_kind_of_the_registry_is_compared() -> None:
    assert {setting.kind for setting in SETTINGS.values()} == set(COMPENSATORS)


def test_plants_scatter_as_published_and_depend_on_the_seed_only() -> None:
    plan = planned(CASES[0], EL_CENTRO)
    plants = np.array(draw(plan, 2000, 7))
    assert plants.mean(axis=0) == pytest.approx([3.3, 425.0, 9.9976e4, 1.19e6], rel=0.03)
    assert plants.std(axis=0) == pytest.approx([1.3, 3.3, 3.3e3, 5e4], rel=0.06)
    assert plants.min() > 0.0
    assert draw(plan, 5, 7) == draw(plan, 20, 7)[:5]
    assert draw(plan, 5, 7) != draw(plan, 5, 8)


def test_another_plant_does_not_change_the_whole_building() -> None:
    plan = planned(CASES[2], EL_CENTRO)
    other = with_plant(plan, draw(plan, 1, 3)[0])
    assert other.column.stiffness != plan.column.stiffness
    for ours, theirs in zip(partition.matrices(other), partition.matrices(plan), strict=True):
        assert np.array_equal(ours, theirs)


def test_a_setting_does_not_change_the_force_correction() -> None:
    plan = planned(CASES[0], EL_CENTRO)
    assert with_compensator(plan, SETTINGS["amb"]).compensator.force == plan.compensator.force
    assert plan.compensator.force.unit_delay


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
@pytest.mark.parametrize("setting", ["sample", "amb"])
def test_every_case_passes_the_preflight_of_its_plan(case: PartitionCase, setting: str) -> None:
    plan = with_compensator(planned(case, EL_CENTRO), SETTINGS[setting])
    found = preflight.checks(plan.with_ticks(round(8.0 / plan.test.interval)))
    risks = {check.risk.name for check in found if check.risk}
    assert risks <= ({"partition"} if setting == "sample" else set())
