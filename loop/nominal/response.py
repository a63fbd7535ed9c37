"""The response of the whole building without a laboratory, which an ideal hybrid test would measure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.plan import Plan
from loop.nominal.partition import matrices
from models import integrators
from models.compiled import jit
from models.integrators.state import NEXT_DISPLACEMENT
from models.registry import Array


class WholeBuilding(NamedTuple):
    """The state of the whole building, which `march` advances."""

    code: int  # of the integrator
    coefficients: Array  # of the integrator
    K: Array  # (n, n) N/m
    mass: Array  # (n,) kg
    state: Array  # (rows, n) of the integrator
    balance: Array  # (n,) external minus restoring force, N


def response(plan: Plan, ground: Array) -> Array:
    """Displacements (ticks, n) m of the floors relative to the ground, from rest, by the plan's integrator.

    `M·ẍ + C·ẋ + K·x = −M·1·z̈` with the matrices of the whole building, including the part of the specimen. `ground`
    (2, ticks + 1) is that of `substructure.ground_rows`.

    Raises:
        InputError: the method is unknown or would diverge, or the numerical columns are not linear.
    """
    structure = plan.structure
    if structure.columns.model != "linear":
        raise InputError(
            f"The response of the whole building needs linear columns, not '{structure.columns.model}': choose "
            "'linear' in [structure.columns]."
        )
    M, C, K = matrices(plan)
    method = integrators.build(structure.integrator, M, C, K, plan.test.interval, structure.rho_infinity)
    n = plan.storeys
    mass = np.diag(M).copy()
    result = np.zeros((plan.ticks, n))
    state = method.start(np.zeros(n), np.zeros(n), -mass * ground[0, 0])
    numerical = WholeBuilding(
        method.code, method.coefficients, np.ascontiguousarray(K), mass, state, np.zeros(n)
    )
    march(numerical, ground, plan.test.interval, result)
    return result


@jit
def march(whole: WholeBuilding, ground: Array, interval: float, result: Array) -> None:
    """Fill `result` (ticks, n) m from the ground's acceleration."""
    K, mass, state, balance = whole.K, whole.mass, whole.state, whole.balance
    n = mass.size
    for tick in range(result.shape[0]):
        for i in range(n):
            force = -mass[i] * ground[0, tick]
            for j in range(n):
                force -= K[i, j] * state[NEXT_DISPLACEMENT, j]
            balance[i] = force
            result[tick, i] = state[NEXT_DISPLACEMENT, i]
        integrators.step(whole.code, whole.coefficients, state, balance, interval)
