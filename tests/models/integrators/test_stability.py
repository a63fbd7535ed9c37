"""The stability limits of integration methods, and the poles of their amplification."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from models import integrators
from models.integrators import INTEGRATORS
from models.integrators.state import (
    DISPLACEMENT,
    NEXT_DISPLACEMENT,
)
from tests.models.integrators.problems import BOUNDED, CASES, RHOS, SHARP, march, poles, radius, single

ALWAYS = [case for case in CASES if case[0] not in BOUNDED]


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
    def test_conditionally_stable_methods_have_their_stability_limit(self, name: str, zeta: float) -> None:
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
    def test_the_other_methods_are_unconditionally_stable(
        self, name: str, options: dict[str, float], zeta: float, omega_h: float
    ) -> None:
        assert radius(name, omega_h, zeta, options) <= 1.0 + 1e-6

    @pytest.mark.parametrize(("name", "options"), ALWAYS)
    def test_a_long_march_at_omega_h_of_fifty_stays_bounded(
        self, name: str, options: dict[str, float]
    ) -> None:
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
    def test_kr_alpha_has_the_given_spectral_radius_at_infinity(self, rho: float) -> None:
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
    def test_the_explicit_methods_have_their_period_without_damping(self, omega_h: float) -> None:
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
