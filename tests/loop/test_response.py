"""The response of the whole building, compared with the exact one under a load held over each interval."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from common.errors import InputError
from common.plan.plan import Plan
from common.plan.read import parse
from loop import substructure
from loop.nominal.partition import matrices
from loop.nominal.response import response
from models.registry import Array
from tests.helpers import SERVO_PLAN, with_table


@pytest.fixture(scope="module")
def plan() -> Plan:
    return parse(SERVO_PLAN, Path())


def held(plan: Plan, ground: Array) -> Array:
    """Displacements under the acceleration held from tick to tick, by the matrix exponential."""
    M, C, K = matrices(plan)
    n = plan.storeys
    a = np.zeros((2 * n + 1, 2 * n + 1))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n, :n], a[n : 2 * n, n : 2 * n] = -np.linalg.solve(M, K), -np.linalg.solve(M, C)
    a[n : 2 * n, 2 * n] = -1.0
    step, z, rows = expm(a * plan.test.interval), np.zeros(2 * n + 1), []
    for tick in range(plan.ticks):
        rows.append(z[:n])
        z = step @ np.concatenate([z[: 2 * n], [ground[0, tick]]])
    return np.array(rows)


def test_the_runge_kutta_response_is_exact_under_a_held_load(plan: Plan) -> None:
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    expected = held(plan, ground)
    np.testing.assert_allclose(response(plan, ground), expected, atol=1e-6 * np.abs(expected).max(), rtol=0)


@pytest.mark.parametrize("integrator", ["newmark_explicit", "cr"])
def test_other_methods_agree_to_their_order(plan: Plan, integrator: str) -> None:
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    found = response(with_table(plan, "structure", integrator=integrator), ground)
    expected = held(plan, ground)
    assert np.abs(found - expected).max() < 5e-3 * np.abs(expected).max()


def test_yielding_columns_are_refused(default_plan: Plan) -> None:
    columns = replace(
        default_plan.structure.columns, model="bilinear", parameters={"yield_displacement": 0.01}
    )
    plan = replace(default_plan, structure=replace(default_plan.structure, columns=columns))
    with pytest.raises(InputError, match="linear columns, not 'bilinear'"):
        response(plan, np.zeros((2, plan.ticks + 1)))
