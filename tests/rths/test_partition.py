"""What is said before a test starts."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from common.plan import read as plans
from common.plan.plan import Plan
from common.plan.tables import CompensatorTable
from common.terminal import cli
from loop import substructure
from loop.closed_loop import signals, simulate
from loop.nominal.partition import assess, critical_delay_of
from loop.nominal.preflight import partition_text
from tests.helpers import with_table
from validation.paper.experiments import delayed, pulse


def test_the_default_partition(default_plan: Plan) -> None:
    found = assess(default_plan)
    assert found.frequency == pytest.approx(1.989, abs=1e-3)
    assert found.critical_delay == pytest.approx(0.0329, abs=1e-4)
    assert found.delay == pytest.approx(0.0002, abs=1e-4)
    assert found.amplitude == pytest.approx(1.028, abs=2e-3)
    assert "Stable up to 32.9 ms of delay; 2.2 ms expected (margin 15)" in partition_text(default_plan, found)


@pytest.mark.parametrize(("lead", "points"), [(0.0088, 1.9), (0.044, 0.0)])
def test_the_cost_is_that_of_the_residual_delay(default_plan: Plan, lead: float, points: float) -> None:
    plan = with_table(default_plan, "compensator", lead=lead)
    assert 100.0 * assess(plan).damping_points == pytest.approx(points, abs=0.05)


def test_without_compensation_the_path_is_beyond_what_the_loop_bears(default_plan: Plan) -> None:
    found = assess(dataclasses.replace(default_plan, compensator=CompensatorTable("none", {})))
    assert found.delay > found.critical_delay


def test_a_specimen_without_stiffness_bears_any_delay(default_plan: Plan) -> None:
    plan = with_table(default_plan, "column", stiffness=0.0)
    found = assess(plan)
    assert math.isinf(found.critical_delay)
    assert "Stable at any delay; " in partition_text(plan, found)


def test_two_storeys_diverge_beyond_their_critical_delay_only(default_plan: Plan) -> None:
    plan = with_table(
        default_plan, "structure", mass=[1.6e5, 1.6e5], stiffness=[50e6, 40e6], damping=[4e5, 3e5]
    )
    plan = with_table(plan, "column", stiffness=20e6, storey=2)
    critical = critical_delay_of(plan)
    growth = []
    for factor in (0.9, 1.1):
        late = plans.with_test(delayed(plan, factor * critical), duration=20.0)
        drift = np.abs(signals(late, simulate(late, pulse(late)))["column_target"])
        middle = drift.size // 2
        growth.append(drift[middle:].max() / drift[1000:middle].max())
    assert growth[0] < 1.0 < growth[1]


@pytest.mark.parametrize("name", cli.SHIPPED)
def test_every_plan_that_ships_is_stable_and_says_so(name: str) -> None:
    plan = plans.load(cli.plan_path(name))
    assert plan.test.name == name
    found = assess(plan)
    assert found.delay < found.critical_delay
    assert simulate(plan, substructure.ground_rows(plan, substructure.motion(plan))).finite
