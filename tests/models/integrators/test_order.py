"""Integration methods against exact solutions: order, equivalences, and specimens that yield."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from common.errors import InputError
from models import integrators, specimens
from models.integrators import INTEGRATORS, kr_alpha, rk4
from models.integrators.state import (
    ACCELERATION,
    DISPLACEMENT,
    NEXT_DISPLACEMENT,
    NEXT_VELOCITY,
    VELOCITY,
    Floats,
)
from models.registry import Array
from models.structures import shear_building
from tests.models.integrators.problems import (
    ERROR,
    EVERY,
    INTERVALS,
    Problem,
    exact,
    march,
    orders,
    poles,
    radius,
    single,
    three,
)


class TestOrder:
    @EVERY
    @pytest.mark.parametrize("problem", [single(), three()], ids=["one", "three"])
    def test_displacement_velocity_and_acceleration_have_their_order_of_accuracy(
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
    def test_the_exact_solution_agrees_with_an_adaptive_solver(
        self, name: str, options: dict[str, float]
    ) -> None:
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
    def test_the_estimated_next_velocity_is_second_order_within_one_step(
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


class TestEquivalences:
    @pytest.mark.parametrize("problem", [single(), three()], ids=["one", "three"])
    def test_central_difference_and_explicit_newmark_are_equivalent(self, problem: Problem) -> None:
        one = march(problem, "newmark_explicit", 0.002)
        other = march(problem, "central_difference", 0.002)
        for row, share in ((DISPLACEMENT, 1e-10), (VELOCITY, 1e-9), (ACCELERATION, 1e-7)):
            largest = np.abs(one[:, row]).max()
            np.testing.assert_allclose(one[:, row], other[:, row], atol=share * largest, rtol=0)

    @pytest.mark.parametrize("problem", [single(), three()], ids=["one", "three"])
    def test_kr_alpha_without_numerical_damping_equals_cr(self, problem: Problem) -> None:
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
    def test_a_yielding_storey_agrees_with_an_adaptive_solver(
        self, name: str, options: dict[str, float]
    ) -> None:
        interval = 0.001
        times = np.arange(2001) * interval
        expected = self.reference(times)
        assert np.abs(expected).max() > 3 * self.YIELD
        got = self.march(name, interval, times, options)
        atol = 0.5 * ERROR[INTEGRATORS[name].order] * np.abs(expected).max()
        np.testing.assert_allclose(got, expected, atol=atol, rtol=0)


class TestRungeKutta:
    def test_a_runge_kutta_step_equals_its_four_stages(self) -> None:
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

    def test_free_vibration_by_runge_kutta_is_fourth_order(self) -> None:
        problem = three()._replace(force=np.zeros(3))
        errors = []
        for interval in INTERVALS:
            states = march(problem, "rk4", interval)
            x, _ = exact(problem, np.arange(len(states)) * interval)
            errors.append(float(np.abs(states[:, DISPLACEMENT] - x).max()))
        assert min(orders(errors)) > 3.85, errors

    @pytest.mark.parametrize("zeta", [0.0, 0.02, 0.1, 0.3, 0.5, 0.55, 0.7, 1.0])
    def test_runge_kutta_is_stable_below_its_limit_for_every_damping_ratio(self, zeta: float) -> None:
        assert (
            max(radius("rk4", share * INTEGRATORS["rk4"].limit, zeta) for share in (0.2, 0.6, 0.999)) <= 1.0
        )

    def test_runge_kuttas_limit_is_sharp_near_half_critical_damping_and_root_of_eight_without_damping(
        self,
    ) -> None:
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

    def test_a_numerical_part_that_is_unstable_without_its_specimen_is_accepted(self) -> None:
        M, K = np.diag([1e3, 1e3]), np.array([[1e6, -1e6], [-1e6, 1e6]])
        for stiffness in (K, K - 1e5 * np.eye(2)):
            method = integrators.build("rk4", M, np.zeros((2, 2)), stiffness, 0.01)
            assert method.code == integrators.INTEGRATORS["rk4"].code

    @pytest.mark.parametrize("omega_h", [0.1, 0.2, 0.3])
    def test_runge_kutta_damps_low_modes_with_the_fifth_power_of_the_interval(self, omega_h: float) -> None:
        pole = poles("rk4", omega_h)[0]
        damping = -math.log(abs(pole)) / abs(np.angle(pole))
        assert damping == pytest.approx(omega_h**5 / 144.0, rel=0.02)
