"""The loop without slaves, compared with the whole closed loop and with equations written out separately."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError
from common.plan import read as plans
from common.plan.laboratory_tables import CompensatorTable
from common.plan.plan import Plan, ideal
from common.plan.read import parse, with_test
from common.roles import MASTER
from common.signals import OF_STOREYS
from laboratories import effects
from laboratories.column.kind import COLUMN
from laboratories.sensors import noise
from loop import closed_loop, site, substructure
from loop.closed_loop import Rollout
from loop.nominal import partition
from loop.nominal.response import response
from loop.signals import signals as signals_of
from models.registry import Array
from models.structures import shear_building
from models.system import Effects, System
from tests.helpers import SERVO_PLAN, with_table


@pytest.fixture(scope="module")
def plan() -> Plan:
    return parse(SERVO_PLAN, Path())


def ground_of(plan: Plan) -> Array:
    return substructure.ground_rows(plan, substructure.motion(plan))


def alone(plan: Plan, ground: Array, **options: Any) -> Rollout:
    return closed_loop.simulate(plan, ground, slaves={}, **options)


def assert_same(found: Rollout, whole: Rollout) -> None:
    assert (found.finite, found.ticks) == (whole.finite, whole.ticks)
    assert not found.slaves
    for name in (
        "ground_acceleration",
        "column_target",
        "actuator_command",
        *COLUMN.channels.names,
        *OF_STOREYS,
    ):
        assert np.array_equal(found.master[name], whole.master[name]), name


@pytest.mark.parametrize("seed", [None, 5])
def test_the_loop_without_slaves_equals_the_closed_loop_to_the_last_bit(plan: Plan, seed: int | None) -> None:
    ground = ground_of(plan)
    found = alone(plan, ground, seed=seed)
    assert found.finite
    assert_same(found, closed_loop.simulate(plan, ground, seed=seed))


@pytest.mark.parametrize(
    "laid",
    [
        [("column.yielding", {"yield_displacement": 2e-3, "hardening": 0.1})],
        [("actuator.backlash", {"width": 1e-4}), ("column.inertia", {"mass": 100.0})],
        [("structure.p_delta", {"stiffness": -5e5}), ("sensor.column_force.lag", {"time_constant": 0.002})],
    ],
)
def test_the_loop_without_slaves_equals_the_closed_loop_with_effects_and_any_compensator(
    default_plan: Plan, laid: list[effects.Entry]
) -> None:
    base = with_table(with_test(default_plan, duration=3.0), "control", amd=False)
    system = effects.lay(System(base), laid)
    ground = ground_of(base)
    found = alone(system.plan, ground, effects=system.effects, seed=1)
    assert_same(found, closed_loop.simulate(system.plan, ground, effects=system.effects, seed=1))


def test_given_noise_equals_the_noise_of_the_seed(plan: Plan) -> None:
    ground = ground_of(plan)
    rows = site.errors(COLUMN, System(plan), plan.ticks, noise.lab_seed(9, noise.LAB_A))
    one, other = (
        alone(plan, ground, noise={MASTER: rows}),
        alone(plan, ground, seed=9),
    )
    assert np.array_equal(one.master["column_force"], other.master["column_force"])
    with pytest.raises(InputError, match="given twice"):
        alone(plan, ground, noise={MASTER: rows}, seed=9)
    with pytest.raises(InputError, match="one row per tick"):
        alone(plan, ground, noise={MASTER: rows[1:]})


def test_the_loop_without_slaves_refuses_a_plan_with_a_damper(default_plan: Plan) -> None:
    with pytest.raises(InputError, match="set amd"):
        alone(default_plan, ground_of(default_plan))


def test_a_diverging_loop_ends_where_its_command_exceeds_all_bounds(plan: Plan) -> None:
    parameters = {"proportional": 40.0, "integral": 0.0, "derivative": 0.0}
    wild = replace(plan, compensator=CompensatorTable("pid", parameters))
    found = alone(wild, ground_of(wild), farthest=1e6)
    assert not found.finite
    assert 0 < found.ticks < wild.ticks
    assert found.master["displacement"].shape == (found.ticks, plan.storeys)
    assert np.all(np.abs(found.master["actuator_command"]) <= 1e6)
    assert np.all(np.isfinite(found.master["displacement"]))


def test_rollouts_in_threads_equal_those_in_one_thread(plan: Plan) -> None:
    ground = ground_of(plan)
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda seed: alone(plan, ground, seed=seed).master["column_force"], range(4)))
    for seed, force in enumerate(found):
        assert np.array_equal(force, alone(plan, ground, seed=seed).master["column_force"])


def written_out(plan: Plan, ground: Array, *, late: bool) -> Array:
    """Floor displacements with an ideal actuator, by Runge-Kutta on the numerical part under a held force."""
    M, C, K = partition.numerical(plan)
    inverse, h, n = np.linalg.inv(M), plan.test.interval, plan.storeys
    whole = partition.matrices(plan).M @ np.ones(n)
    column, direction = plan.column, partition.drift_direction(plan)
    z, rows, deformations, used = np.zeros(2 * n), [], [0.0, 0.0], 0.0
    for tick in range(plan.ticks):
        rows.append(z[:n])
        now = float(direction @ z[:n])
        rate, before = (now - deformations[-1]) / h, (deformations[-1] - deformations[-2]) / h
        acceleration = (rate - before) / h if tick > 1 else 0.0
        force = column.stiffness * now + column.damping * rate + column.mass * acceleration
        deformations.append(now)
        load = -whole * ground[0, tick] - direction * (used if late else force)
        used = force

        def slope(y: Array, load: Array = load) -> Array:
            return np.concatenate([y[n:], inverse @ (load - C @ y[n:] - K @ y[:n])])

        one = slope(z)
        two = slope(z + 0.5 * h * one)
        three = slope(z + 0.5 * h * two)
        z = z + h / 6.0 * (one + 2.0 * two + 2.0 * three + slope(z + h * three))
    return np.array(rows)


@pytest.mark.parametrize("late", [False, True])
def test_with_an_ideal_actuator_the_loop_solves_the_separately_written_equations(
    plan: Plan, late: bool
) -> None:
    base = ideal(with_test(plan, duration=1.0))
    force = replace(base.compensator.force, unit_delay=late)
    base = replace(base, compensator=replace(base.compensator, force=force))
    ground = ground_of(base)
    found = alone(base, ground)
    expected = written_out(base, ground, late=late)
    np.testing.assert_allclose(
        found.master["displacement"], expected, atol=1e-9 * np.abs(expected).max(), rtol=0
    )


def test_with_an_ideal_actuator_the_loop_equals_the_whole_building(plan: Plan) -> None:
    base = ideal(plan)
    ground = ground_of(base)
    expected = response(base, ground)
    found = alone(base, ground).master["displacement"]
    assert np.abs(found - expected).max() < 0.01 * np.abs(expected).max()
    numb = replace(base, column=replace(base.column, mass=0.0, damping=0.0, stiffness=0.0))
    assert np.abs(alone(numb, ground).master["displacement"] - expected).max() > 0.1 * np.abs(expected).max()


def tower(rows: bool, **column: Any) -> Plan:
    """Three storeys, their stiffness one value each or as the matrix of the same building."""
    stiffness: Any = [3e7, 2e7, 1.5e7]
    taken = {"stiffness": 2.5e6, "mass": 0.0, "damping": 0.0}
    if rows:
        stiffness = shear_building.tridiagonal(np.array(stiffness)).tolist()
    tables = {
        "test": {"duration": 3.0},
        "structure": {
            "mass": [1e5] * 3,
            "stiffness": stiffness,
            "damping": [1e5] * 3,
            "experimental": taken,
        },
        "column": {"stiffness": 5e6, "storey": 2} | column,
        "control": {"amd": False},
    }
    return plans.from_tables(tables, Path())


@pytest.mark.parametrize("integrator", ["newmark_explicit", "rk4", "kr_alpha"])
@pytest.mark.parametrize("p_delta", [0.0, -1e6])
def test_a_stiffness_matrix_and_its_storeys_give_the_same_building(integrator: str, p_delta: float) -> None:
    found = []
    for rows in (True, False):
        base = with_table(tower(rows), "structure", integrator=integrator)
        rollout = closed_loop.simulate(base, ground_of(base), effects=Effects(p_delta=p_delta))
        signals = signals_of(base, rollout)
        found.append((signals["displacement"], signals["numerical_force"]))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9 * np.abs(other).max(), rtol=0)


@pytest.mark.parametrize("name", ["mass", "stiffness", "damping"])
@pytest.mark.parametrize("ratio", [False, True])
def test_effects_on_the_structure_scale_its_numerical_part(plan: Plan, name: str, ratio: bool) -> None:
    base = plan if ratio else replace(plan, structure=replace(plan.structure, damping=(1e4,) * 3))
    if not ratio:
        base = replace(base, structure=replace(base.structure, damping_ratio=0.0))
    system = effects.lay(System(base), [(f"structure.{name}", {"factor": 1.2})])
    place = ("mass", "damping", "stiffness").index(name)
    before, after = partition.numerical(base)[place], partition.numerical(system.plan)[place]
    np.testing.assert_allclose(after, 1.2 * before, rtol=1e-12)
    assert math.isfinite(partition.critical_delay_of(system.plan))
