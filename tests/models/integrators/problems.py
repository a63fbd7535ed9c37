"""Linear structures for tests of the integration methods, their exact motion, and the list of methods."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from scipy.linalg import expm

from models import integrators
from models.integrators import INTEGRATORS
from models.integrators.state import (
    NEXT_DISPLACEMENT,
    ROWS,
    Floats,
)
from models.registry import Array
from models.structures import shear_building

RHOS = (0.0, 0.25, 0.5, 0.8, 1.0)
# every method, and those with options at several values: name, options
CASES: list[tuple[str, dict[str, float]]] = [
    (name, {"rho_infinity": rho} if "rho_infinity" in method.options else {})
    for name, method in INTEGRATORS.items()
    for rho in (RHOS if "rho_infinity" in method.options else (0.0,))
]
IDS = ["-".join([name, *map(str, options.values())]) for name, options in CASES]
EVERY = pytest.mark.parametrize(("name", "options"), CASES, ids=IDS)
BOUNDED = [name for name, method in INTEGRATORS.items() if math.isfinite(method.limit)]
SHARP = [name for name in BOUNDED if name != "rk4"]  # whose limit is the same whatever the damping
ERROR = {1: 3e-2, 2: 2e-3}  # over the largest displacement, by order


class Problem(NamedTuple):
    """Linear structure under `p = force·sin(Ω·t + φ)`."""

    M: Array
    C: Array
    K: Array
    force: Array
    x0: Array
    v0: Array
    omega: float = 9.0
    phase: float = 0.7
    duration: float = 1.6

    def load(self, t: float) -> Array:
        return np.asarray(self.force * math.sin(self.omega * t + self.phase))


def single() -> Problem:
    """The seed paper's storey, damped five times as much."""
    M, C, K = np.array([[160e3]]), np.array([[1e6]]), np.array([[25e6]])
    return Problem(M, C, K, np.array([4e5]), np.array([0.01]), np.array([-0.2]))


def three() -> Problem:
    """Three storeys whose damping is not in proportion to mass or stiffness."""
    mass, stiffness = np.array([180e3, 160e3, 120e3]), np.array([9e7, 7e7, 4e7])
    M, C, K = shear_building.matrices(mass, stiffness, np.array([9e5, 1e5, 6e5]))
    return Problem(
        M, C, K, np.array([2e5, -1e5, 3e5]), np.array([0.01, 0.005, -0.02]), np.array([0.1, 0.3, -0.2])
    )


def exact(problem: Problem, times: Floats) -> tuple[Array, Array]:
    """Displacement and velocity at equally spaced times, by the matrix exponential with the load as states."""
    n = problem.x0.size
    inverse = np.linalg.inv(problem.M)
    a = np.zeros((2 * n + 2, 2 * n + 2))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n, :n] = -inverse @ problem.K
    a[n : 2 * n, n : 2 * n] = -inverse @ problem.C
    a[n : 2 * n, 2 * n] = inverse @ problem.force
    a[2 * n, 2 * n + 1], a[2 * n + 1, 2 * n] = problem.omega, -problem.omega
    step = expm(a * (times[1] - times[0]))
    z = np.concatenate([problem.x0, problem.v0, [math.sin(problem.phase), math.cos(problem.phase)]])
    rows = [z]
    for _ in times[1:]:
        rows.append(step @ rows[-1])
    table = np.array(rows)
    return table[:, :n], table[:, n : 2 * n]


def march(problem: Problem, name: str, interval: float, **options: float) -> Array:
    """States of a method at every tick; shape (ticks, ROWS, n)."""
    method = integrators.build(name, problem.M, problem.C, problem.K, interval, **options)
    s = method.start(problem.x0, problem.v0, problem.load(0.0) - problem.K @ problem.x0)
    rows = []
    for k in range(round(problem.duration / interval) + 1):
        g = problem.load(k * interval) - problem.K @ s[NEXT_DISPLACEMENT]
        integrators.step(method.code, method.coefficients, s, g, interval)
        rows.append(s.copy())
    return np.array(rows)


def orders(errors: list[float]) -> list[float]:
    return [math.log2(a / b) for a, b in pairwise(errors)]


INTERVALS = (0.008, 0.004, 0.002, 0.001)


def amplification(
    name: str, omega_h: float, zeta: float = 0.0, options: dict[str, float] | None = None
) -> Array:
    """Map of the state's rows in use over one step of a single degree of freedom with ω = 1."""
    one = np.ones((1, 1))
    method = INTEGRATORS[name]
    c = method.coefficients(one, 2.0 * zeta * one, one, omega_h, **(options or {}))
    columns = []
    for row in range(ROWS):
        s = np.zeros((ROWS, 1))
        s[row] = 1.0
        integrators.step(method.code, c, s, -s[NEXT_DISPLACEMENT].copy(), omega_h)
        columns.append(s[:, 0])
    whole = np.array(columns).T
    used = np.any(whole != np.eye(ROWS), axis=1)
    return np.asarray(whole[np.ix_(used, used)])


def poles(name: str, omega_h: float, zeta: float = 0.0, options: dict[str, float] | None = None) -> Array:
    """Eigenvalues of the amplification, the largest first."""
    values = np.linalg.eigvals(amplification(name, omega_h, zeta, options))
    return np.asarray(values[np.argsort(-np.abs(values))])


def radius(name: str, omega_h: float, zeta: float = 0.0, options: dict[str, float] | None = None) -> float:
    return float(np.abs(poles(name, omega_h, zeta, options)).max())
