"""Integration methods: every claim over the registry, each against exact or other solutions."""

from __future__ import annotations

import math
from importlib import import_module
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from common.errors import InputError
from models import integrators, specimens
from models.integrators import INTEGRATORS, kr_alpha, rk4
from models.integrators.state import (
    ACCELERATION,
    DISPLACEMENT,
    NEXT_DISPLACEMENT,
    NEXT_VELOCITY,
    ROWS,
    VELOCITY,
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
ALWAYS = [case for case in CASES if case[0] not in BOUNDED]
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


class TestOrder:
    @EVERY
    @pytest.mark.parametrize("problem", [single(), three()], ids=["one", "three"])
    def test_displacement_velocity_and_acceleration(
        self, name: str, options: dict[str, float], problem: Problem
    ) -> None:
        errors: dict[str, list[float]] = {"x": [], "v": [], "a": [], "next": []}
        for interval in INTERVALS:
            states = march(problem, name, interval, **options)
            times = np.arange(len(states) + 1) * interval
            x, v = exact(problem, times)
            loads = np.array([problem.load(t) for t in times])
            a = np.linalg.solve(problem.M, (loads - v @ problem.C.T - x @ problem.K.T).T).T
            errors["x"].append(float(np.abs(states[:, DISPLACEMENT] - x[:-1]).max()))
            errors["v"].append(float(np.abs(states[:, VELOCITY] - v[:-1]).max()))
            errors["a"].append(float(np.abs(states[:, ACCELERATION] - a[:-1]).max()))
            errors["next"].append(float(np.abs(states[:, NEXT_VELOCITY] - v[1:]).max()))
        for quantity, values in errors.items():
            assert min(orders(values)[1:]) > INTEGRATORS[name].order - 0.15, (quantity, values)

    @EVERY
    def test_reference_is_that_of_an_adaptive_solver_too(self, name: str, options: dict[str, float]) -> None:
        problem = three()
        interval, n = 0.0005, 3
        states = march(problem, name, interval, **options)

        def rate(t: float, z: Array) -> Array:
            force = problem.load(t) - problem.C @ z[n:] - problem.K @ z[:n]
            return np.concatenate([z[n:], np.linalg.solve(problem.M, force)])

        start = np.concatenate([problem.x0, problem.v0])
        times = np.arange(len(states)) * interval
        solution = solve_ivp(
            rate, (0.0, times[-1]), start, t_eval=times, method="DOP853", rtol=1e-11, atol=1e-13
        )
        largest = np.abs(solution.y[:n]).max()
        atol = ERROR[INTEGRATORS[name].order] * largest
        np.testing.assert_allclose(states[:, DISPLACEMENT], solution.y[:n].T, atol=atol, rtol=0)

    @EVERY
    def test_the_estimated_next_velocity_is_of_second_order_within_one_step(
        self, name: str, options: dict[str, float]
    ) -> None:
        problem = three()
        errors = []
        for interval in (0.004, 0.002, 0.001):
            state = march(problem._replace(duration=0.0), name, interval, **options)[0]
            errors.append(
                float(np.abs(state[NEXT_VELOCITY] - exact(problem, np.array([0, interval]))[1][1]).max())
            )
        assert min(orders(errors)) > 1.85, errors

    @EVERY
    def test_a_load_that_does_not_begin_at_zero_keeps_the_order_from_rest(
        self, name: str, options: dict[str, float]
    ) -> None:
        problem = single()._replace(x0=np.zeros(1), v0=np.zeros(1), phase=math.pi / 2)
        errors = []
        for interval in INTERVALS:
            states = march(problem, name, interval, **options)
            x, _ = exact(problem, np.arange(len(states)) * interval)
            errors.append(float(np.abs(states[:, DISPLACEMENT] - x).max()))
        assert min(orders(errors)) > INTEGRATORS[name].order - 0.15, errors


class TestRegistry:
    def test_codes_are_distinct(self) -> None:
        assert sorted(method.code for method in INTEGRATORS.values()) == list(range(len(INTEGRATORS)))

    @EVERY
    def test_coefficients_are_what_one_compiled_version_takes(
        self, name: str, options: dict[str, float]
    ) -> None:
        problem = three()
        c = integrators.build(name, problem.M, problem.C, problem.K, 0.002, **options).coefficients
        assert c.shape[1:] == (3, 3)
        assert c.dtype == np.float64
        assert c.flags.c_contiguous

    @EVERY
    def test_dispatch_equals_the_method_itself(self, name: str, options: dict[str, float]) -> None:
        problem = three()
        method = integrators.build(name, problem.M, problem.C, problem.K, 0.002, **options)
        one = np.random.default_rng(5).standard_normal((ROWS, 3))
        other, g = one.copy(), np.array([1e4, -2e4, 3e4])
        integrators.step(method.code, method.coefficients, one, g, 0.002)
        import_module(f"models.integrators.{name}").step(method.coefficients, other, g, 0.002)
        np.testing.assert_array_equal(one, other)
        assert g.tolist() == [1e4, -2e4, 3e4]

    @EVERY
    def test_motion_is_in_equilibrium_and_the_next_becomes_the_present(
        self, name: str, options: dict[str, float]
    ) -> None:
        problem = three()
        states = march(problem, name, 0.002, **options)
        for k, s in enumerate(states[1:], start=1):
            np.testing.assert_array_equal(s[DISPLACEMENT], states[k - 1][NEXT_DISPLACEMENT])
            g = problem.load(k * 0.002) - problem.K @ s[DISPLACEMENT]
            inertia = problem.M @ s[ACCELERATION] + problem.C @ s[VELOCITY]
            np.testing.assert_allclose(inertia, g, atol=1e-6, rtol=1e-9)

    @EVERY
    def test_the_first_step_finds_the_start(self, name: str, options: dict[str, float]) -> None:
        problem = three()
        first = march(problem, name, 0.002, **options)[0]
        np.testing.assert_array_equal(first[DISPLACEMENT], problem.x0)
        np.testing.assert_allclose(first[VELOCITY], problem.v0, rtol=1e-10)

    @EVERY
    def test_rest_stays_at_rest(self, name: str, options: dict[str, float]) -> None:
        problem = three()
        method = integrators.build(name, problem.M, problem.C, problem.K, 0.002, **options)
        s, zero = integrators.rest(3), np.zeros(3)
        np.testing.assert_array_equal(method.start(zero, zero, zero), s)
        integrators.step(method.code, method.coefficients, s, zero, 0.002)
        assert not s.any()

    @EVERY
    def test_storeys_apart_move_as_single_ones(self, name: str, options: dict[str, float]) -> None:
        one = single()
        two = Problem(
            one.M * np.eye(2),
            one.C * np.eye(2),
            one.K * np.eye(2),
            np.array([4e5, -2e5]),
            np.array([0.01, 0.02]),
            np.array([-0.2, 0.1]),
        )
        other = one._replace(force=np.array([-2e5]), x0=np.array([0.02]), v0=np.array([0.1]))
        apart = np.concatenate([march(p, name, 0.002, **options) for p in (one, other)], axis=2)
        together = march(two, name, 0.002, **options)
        for row in range(NEXT_VELOCITY + 1):
            np.testing.assert_allclose(together[:, row], apart[:, row], atol=1e-9, rtol=1e-9)


class TestBuild:
    def test_unknown_method(self) -> None:
        problem = single()
        with pytest.raises(InputError, match="did you mean kr_alpha"):
            integrators.build("kr_alfa", problem.M, problem.C, problem.K, 0.002)

    @pytest.mark.parametrize("rho", [-0.1, 1.1, math.nan])
    def test_spectral_radius_out_of_range(self, rho: float) -> None:
        problem = single()
        with pytest.raises(InputError, match="at least 0 and at most 1"):
            integrators.build("kr_alpha", problem.M, problem.C, problem.K, 0.002, rho)

    @pytest.mark.parametrize("name", BOUNDED)
    def test_an_interval_that_diverges_is_refused(self, name: str) -> None:
        problem = three()
        limit = shear_building.modes(problem.M, problem.C, problem.K).periods[-1] / (2.0 * math.pi)
        limit *= INTEGRATORS[name].limit
        integrators.build(name, problem.M, problem.C, problem.K, 0.999 * limit)
        with pytest.raises(InputError, match="interval below"):
            integrators.build(name, problem.M, problem.C, problem.K, 1.001 * limit)

    def test_a_building_without_stiffness_is_stable(self) -> None:
        method = integrators.build("newmark_explicit", np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), 0.1)
        assert np.all(np.isfinite(method.coefficients))


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


def generalised_alpha(rho: float, omega_h: float, zeta: float) -> Any:
    """Eigenvalues of the implicit method of Chung and Hulbert (1993) for (x, h·v, h²·a), ω = 1."""
    alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    gamma, beta = 0.5 - alpha_m + alpha_f, 0.25 * (1 - alpha_m + alpha_f) ** 2
    w, d = omega_h**2, 2 * zeta * omega_h
    left = np.array([[1, 0, -beta], [0, 1, -gamma], [(1 - alpha_f) * w, (1 - alpha_f) * d, 1 - alpha_m]])
    right = np.array([[1, 1, 0.5 - beta], [0, 1, 1 - gamma], [-alpha_f * w, -alpha_f * d, -alpha_m]])
    return np.linalg.eigvals(np.linalg.solve(left, right))


class TestStability:
    @pytest.mark.parametrize("name", SHARP)
    @pytest.mark.parametrize("zeta", [0.0, 0.05, 0.5])
    def test_limit_of_the_bounded_methods(self, name: str, zeta: float) -> None:
        limit = INTEGRATORS[name].limit
        assert radius(name, 0.999 * limit, zeta) <= 1.0 + 1e-9
        assert radius(name, 1.001 * limit, zeta) > 1.0 + 1e-4

    @pytest.mark.parametrize("name", SHARP)
    def test_just_below_the_limit_stays_bounded_and_just_above_grows(self, name: str) -> None:
        method, one = INTEGRATORS[name], np.ones((1, 1))
        largest = []
        for omega_h in (1.99, 2.01):
            c = method.coefficients(one, 0.0 * one, one, omega_h)
            s = method.initial_state(c, one, 0.0 * one, one[0], 0.0 * one[0], -one[0], omega_h)
            for _ in range(500):
                integrators.step(method.code, c, s, -s[NEXT_DISPLACEMENT].copy(), omega_h)
            largest.append(float(np.abs(s[DISPLACEMENT, 0])))
        assert largest[0] < 20.0
        assert largest[1] > 1e6

    @pytest.mark.parametrize(("name", "options"), ALWAYS)
    @pytest.mark.parametrize("zeta", [0.0, 0.02, 0.5])
    @pytest.mark.parametrize("omega_h", [0.1, 2.0, 50.0, 1e3])
    def test_the_others_are_always_stable(
        self, name: str, options: dict[str, float], zeta: float, omega_h: float
    ) -> None:
        assert radius(name, omega_h, zeta, options) <= 1.0 + 1e-6

    @pytest.mark.parametrize(("name", "options"), ALWAYS)
    def test_long_march_at_fifty(self, name: str, options: dict[str, float]) -> None:
        # released from a deformation
        problem = single()._replace(force=np.zeros(1), v0=np.zeros(1))
        interval = 50.0 / math.sqrt(25e6 / 160e3)
        quiet = problem._replace(C=0.02 * problem.C, duration=2000 * interval)
        states = march(quiet, name, interval, **options)
        assert np.abs(states[:, DISPLACEMENT]).max() < 0.02
        assert np.abs(states[-500:, DISPLACEMENT]).max() < 0.01

    @pytest.mark.parametrize(("name", "options"), ALWAYS)
    @pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
    def test_softening_below_the_initial_stiffness_stays_stable(
        self, name: str, options: dict[str, float], share: float
    ) -> None:
        method, one = INTEGRATORS[name], np.ones((1, 1))
        c = method.coefficients(one, 0.1 * one, one, 30.0, **options)
        s = method.initial_state(c, one, 0.1 * one, one[0], 0.0 * one[0], -share * one[0], 30.0)
        for _ in range(3000):
            integrators.step(method.code, c, s, -share * s[NEXT_DISPLACEMENT], 30.0)
        assert np.abs(s[DISPLACEMENT, 0]) < 100.0


class TestPoles:
    @pytest.mark.parametrize("rho", RHOS)
    def test_kr_alpha_spectral_radius_at_infinity(self, rho: float) -> None:
        # all three poles meet in −ρ, where eigenvalues are found to the cube root of rounding only
        assert radius("kr_alpha", 1e4, 0.0, {"rho_infinity": rho}) == pytest.approx(rho, abs=5e-3)
        own = np.poly(poles("kr_alpha", 1e6, 0.0, {"rho_infinity": rho})[:3])
        np.testing.assert_allclose(own, np.poly([-rho, -rho, -rho]), atol=1e-6)

    @pytest.mark.parametrize("rho", RHOS)
    @pytest.mark.parametrize("zeta", [0.0, 0.05, 0.3])
    @pytest.mark.parametrize("omega_h", [0.05, 0.5, 2.0, 20.0])
    def test_kr_alpha_has_the_poles_of_the_generalised_alpha_method(
        self, rho: float, zeta: float, omega_h: float
    ) -> None:
        own = np.poly(poles("kr_alpha", omega_h, zeta, {"rho_infinity": rho})[:3])
        np.testing.assert_allclose(own, np.poly(generalised_alpha(rho, omega_h, zeta)), atol=1e-8)

    @pytest.mark.parametrize("omega_h", [0.1, 0.5, 1.5])
    def test_period_of_the_explicit_methods(self, omega_h: float) -> None:
        for name in SHARP:
            pair = poles(name, omega_h)[:2]
            np.testing.assert_allclose(np.abs(np.angle(pair)), 2.0 * math.asin(omega_h / 2.0), rtol=1e-9)
            np.testing.assert_allclose(np.abs(pair), 1.0, atol=1e-9)

    @pytest.mark.parametrize("omega_h", [0.1, 0.5, 3.0, 50.0])
    @pytest.mark.parametrize("zeta", [0.0, 0.05])
    def test_cr_has_the_poles_of_average_acceleration(self, omega_h: float, zeta: float) -> None:
        a = np.array([[0.0, omega_h], [-omega_h, -2.0 * zeta * omega_h]])
        trapezoidal = np.linalg.solve(np.eye(2) - 0.5 * a, np.eye(2) + 0.5 * a)
        own = np.poly(poles("cr", omega_h, zeta)[:2])
        np.testing.assert_allclose(own, np.poly(np.linalg.eigvals(trapezoidal)), atol=1e-8)
        if zeta == 0.0:
            angle = np.abs(np.angle(poles("cr", omega_h)[:2]))
            np.testing.assert_allclose(angle, 2.0 * math.atan(omega_h / 2.0), rtol=1e-8)

    @pytest.mark.parametrize("rho", RHOS)
    @pytest.mark.parametrize("omega_h", [0.02, 0.05, 0.1])
    def test_kr_alpha_damps_low_modes_little(self, rho: float, omega_h: float) -> None:
        # leading term of the series of the generalised-α poles
        pole = poles("kr_alpha", omega_h, 0.0, {"rho_infinity": rho})
        principal = pole[np.argmax(np.abs(pole.imag))]
        damping = -math.log(abs(principal)) / abs(np.angle(principal))
        expected = 0.5 * ((1.0 - rho) / (1.0 + rho) * omega_h) ** 3
        assert damping == pytest.approx(expected, rel=0.04, abs=1e-10)


class TestEquivalences:
    @pytest.mark.parametrize("problem", [single(), three()], ids=["one", "three"])
    def test_central_difference_and_explicit_newmark(self, problem: Problem) -> None:
        one = march(problem, "newmark_explicit", 0.002)
        other = march(problem, "central_difference", 0.002)
        for row, share in ((DISPLACEMENT, 1e-10), (VELOCITY, 1e-9), (ACCELERATION, 1e-7)):
            largest = np.abs(one[:, row]).max()
            np.testing.assert_allclose(one[:, row], other[:, row], atol=share * largest, rtol=0)

    @pytest.mark.parametrize("problem", [single(), three()], ids=["one", "three"])
    def test_kr_alpha_without_numerical_damping_and_cr(self, problem: Problem) -> None:
        one = march(problem, "cr", 0.002)
        other = march(problem, "kr_alpha", 0.002, rho_infinity=1.0)
        for row in range(NEXT_VELOCITY + 1):
            largest = np.abs(one[:, row]).max()
            np.testing.assert_allclose(one[:, row], other[:, row], atol=1e-9 * largest, rtol=0)

    def test_kr_alpha_equals_the_equations_of_the_paper(self) -> None:
        problem, h, rho = three(), 0.01, 0.4
        M, C, K = problem.M, problem.C, problem.K
        alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        gamma, beta = 0.5 - alpha_m + alpha_f, 0.25 * (1 - alpha_m + alpha_f) ** 2
        a_1 = np.linalg.solve(M + gamma * h * C + beta * h**2 * K, M)
        a_3 = np.linalg.solve(
            M + gamma * h * C + beta * h**2 * K,
            alpha_m * M + alpha_f * gamma * h * C + alpha_f * beta * h**2 * K,
        )
        method = integrators.build("kr_alpha", M, C, K, h, rho)
        s = method.start(problem.x0, problem.v0, problem.load(0.0) - K @ problem.x0)
        x, w, load = s[NEXT_DISPLACEMENT].copy(), s[kr_alpha.EARLY_VELOCITY].copy(), problem.load(0.0)
        integrators.step(method.code, method.coefficients, s, load - K @ x, h)
        b = s[kr_alpha.FILTERED].copy()
        for k in range(1, 200):
            x_next = x + h * w + h**2 * (0.5 + gamma) * a_1 @ b
            w_next = w + h * a_1 @ b
            np.testing.assert_allclose(s[NEXT_DISPLACEMENT], x_next, rtol=1e-9, atol=1e-12)
            load_next = problem.load(k * h)
            middle = [
                (1 - alpha_f) * new + alpha_f * old
                for new, old in ((load_next, load), (w_next, w), (x_next, x))
            ]
            rest = middle[0] - C @ middle[1] - K @ middle[2] - M @ a_3 @ b
            b = np.linalg.solve(M @ (np.eye(3) - a_3), rest)
            x, w, load = x_next, w_next, load_next
            integrators.step(method.code, method.coefficients, s, load - K @ x, h)


class TestYielding:
    """A bilinear storey that yields both ways under a strong pulse."""

    M, C = np.array([[160e3]]), np.array([[200e3]])
    STIFFNESS, YIELD, HARDENING = 25e6, 0.004, 0.1

    def load(self, t: float) -> float:
        return 160e3 * 4.0 * math.sin(11.0 * t)

    def reference(self, times: Floats) -> Array:
        """Displacement by an adaptive solver, with the elastic part of the deformation as a state."""

        def rate(t: float, y: Array) -> list[float]:
            x, v, z = y
            beyond = (z >= self.YIELD and v > 0.0) or (z <= -self.YIELD and v < 0.0)
            spring = self.STIFFNESS * (self.HARDENING * x + (1.0 - self.HARDENING) * z)
            return [v, (self.load(t) - 200e3 * v - spring) / 160e3, 0.0 if beyond else v]

        solution = solve_ivp(
            rate, (0.0, times[-1]), [0.0] * 3, t_eval=times, max_step=2e-4, rtol=1e-9, atol=1e-12
        )
        return np.asarray(solution.y[0])

    def march(self, name: str, interval: float, times: Floats, options: dict[str, float]) -> Array:
        K = np.array([[self.STIFFNESS]])
        method = integrators.build(name, self.M, self.C, K, interval, **options)
        kind, p, memory = specimens.pack(
            "bilinear", stiffness=self.STIFFNESS, yield_displacement=self.YIELD, hardening=self.HARDENING
        )
        s, rows = method.start(np.zeros(1), np.zeros(1), np.zeros(1)), []
        for t in times:
            force = specimens.step(kind, p, memory, s[NEXT_DISPLACEMENT, 0])
            g = np.array([self.load(float(t)) - force])
            integrators.step(method.code, method.coefficients, s, g, interval)
            rows.append(s[DISPLACEMENT, 0])
        return np.array(rows)

    @EVERY
    def test_against_an_adaptive_solver(self, name: str, options: dict[str, float]) -> None:
        interval = 0.001
        times = np.arange(2001) * interval
        expected = self.reference(times)
        assert np.abs(expected).max() > 3 * self.YIELD
        got = self.march(name, interval, times, options)
        atol = 0.5 * ERROR[INTEGRATORS[name].order] * np.abs(expected).max()
        np.testing.assert_allclose(got, expected, atol=atol, rtol=0)


class TestRungeKutta:
    def test_a_step_is_that_of_the_four_stages(self) -> None:
        problem, h, n = three(), 0.004, 3
        inverse = np.linalg.inv(problem.M)
        load = np.array([3e5, -1e5, 2e5])  # held over the step

        def rate(z: Array) -> Array:
            force = load - problem.C @ z[n:] - problem.K @ z[:n]
            return np.concatenate([z[n:], inverse @ force])

        method = integrators.build("rk4", problem.M, problem.C, problem.K, h)
        s = method.start(problem.x0, problem.v0, load - problem.K @ problem.x0)
        z = np.concatenate([problem.x0, problem.v0])
        for _ in range(50):
            g = load - problem.K @ s[NEXT_DISPLACEMENT]
            integrators.step(method.code, method.coefficients, s, g, h)
            one = rate(z)
            two = rate(z + 0.5 * h * one)
            three_ = rate(z + 0.5 * h * two)
            four = rate(z + h * three_)
            z = z + h / 6.0 * (one + 2.0 * two + 2.0 * three_ + four)
            found = np.concatenate([s[NEXT_DISPLACEMENT], s[NEXT_VELOCITY]])
            np.testing.assert_allclose(found, z, rtol=1e-10, atol=1e-13)

    def test_free_vibration_is_of_order_four(self) -> None:
        problem = three()._replace(force=np.zeros(3))
        errors = []
        for interval in INTERVALS:
            states = march(problem, "rk4", interval)
            x, _ = exact(problem, np.arange(len(states)) * interval)
            errors.append(float(np.abs(states[:, DISPLACEMENT] - x).max()))
        assert min(orders(errors)) > 3.85, errors

    @pytest.mark.parametrize("zeta", [0.0, 0.02, 0.1, 0.3, 0.5, 0.55, 0.7, 1.0])
    def test_below_its_limit_it_is_stable_for_every_damping_ratio(self, zeta: float) -> None:
        assert (
            max(radius("rk4", share * INTEGRATORS["rk4"].limit, zeta) for share in (0.2, 0.6, 0.999)) <= 1.0
        )

    def test_its_limit_is_sharp_near_half_and_that_without_damping_is_the_root_of_eight(self) -> None:
        assert radius("rk4", 1.01 * INTEGRATORS["rk4"].limit, 0.54) > 1.0
        assert radius("rk4", 0.999 * math.sqrt(8.0)) < 1.0 < radius("rk4", 1.001 * math.sqrt(8.0))

    @pytest.mark.parametrize("zeta", [1.5, 5.0, 50.0])
    def test_dashpots_far_above_critical_are_refused_where_a_free_motion_grows(self, zeta: float) -> None:
        problem = three()._replace(force=np.zeros(3), omega=0.0)
        M, K = problem.M, problem.K
        problem = problem._replace(C=shear_building.modal_damping(M, K, zeta))
        omega = 2.0 * math.pi / shear_building.modes(M, problem.C, K).periods.min()
        longest = 2.785293563405282 / (omega * (zeta + math.sqrt(zeta * zeta - 1.0)))
        s = march(problem._replace(duration=400 * longest), "rk4", 0.995 * longest)
        assert np.abs(s[-1, NEXT_DISPLACEMENT]).max() <= np.abs(s[0, DISPLACEMENT]).max()
        with pytest.raises(InputError, match="'rk4' diverges by the dashpots of the numerical part"):
            integrators.build("rk4", M, problem.C, K, 1.005 * longest)
        coefficients = rk4.coefficients(M, problem.C, K, 1.005 * longest)
        s = rk4.initial_state(
            coefficients, M, problem.C, problem.x0, problem.v0, -K @ problem.x0, 1.005 * longest
        )
        sizes = []
        for _ in range(2000):
            rk4.step(coefficients, s, -K @ s[NEXT_DISPLACEMENT], 1.005 * longest)
            sizes.append(np.abs(s[NEXT_DISPLACEMENT]).max())
        assert sizes[-1] > 1e3 * sizes[0]

    def test_a_numerical_part_that_a_specimen_must_hold_is_none_that_the_step_makes_diverge(self) -> None:
        M, K = np.diag([1e3, 1e3]), np.array([[1e6, -1e6], [-1e6, 1e6]])
        for stiffness in (K, K - 1e5 * np.eye(2)):
            method = integrators.build("rk4", M, np.zeros((2, 2)), stiffness, 0.01)
            assert method.code == integrators.INTEGRATORS["rk4"].code

    @pytest.mark.parametrize("omega_h", [0.1, 0.2, 0.3])
    def test_it_damps_low_modes_by_the_fifth_power(self, omega_h: float) -> None:
        pole = poles("rk4", omega_h)[0]
        damping = -math.log(abs(pole)) / abs(np.angle(pole))
        assert damping == pytest.approx(omega_h**5 / 144.0, rel=0.02)
