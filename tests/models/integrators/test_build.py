"""The construction of integration methods: the contents of the registry, and refused arguments."""

from __future__ import annotations

import math
from importlib import import_module

import numpy as np
import pytest

from common.errors import InputError
from models import integrators
from models.integrators import INTEGRATORS
from models.integrators.state import (
    ACCELERATION,
    DISPLACEMENT,
    NEXT_DISPLACEMENT,
    NEXT_VELOCITY,
    ROWS,
    VELOCITY,
)
from models.structures import shear_building
from tests.models.integrators.problems import BOUNDED, EVERY, Problem, march, single, three


class TestRegistry:
    def test_codes_are_distinct(self) -> None:
        assert sorted(method.code for method in INTEGRATORS.values()) == list(range(len(INTEGRATORS)))

    @EVERY
    def test_the_coefficients_of_every_method_fit_one_compiled_version(
        self, name: str, options: dict[str, float]
    ) -> None:
        problem = three()
        c = integrators.build(name, problem.M, problem.C, problem.K, 0.002, **options).coefficients
        assert c.shape[1:] == (3, 3)
        assert c.dtype == np.float64
        assert c.flags.c_contiguous

    @EVERY
    def test_dispatch_by_code_equals_the_method_itself(self, name: str, options: dict[str, float]) -> None:
        problem = three()
        method = integrators.build(name, problem.M, problem.C, problem.K, 0.002, **options)
        one = np.random.default_rng(5).standard_normal((ROWS, 3))
        other, g = one.copy(), np.array([1e4, -2e4, 3e4])
        integrators.step(method.code, method.coefficients, one, g, 0.002)
        import_module(f"models.integrators.{name}").step(method.coefficients, other, g, 0.002)
        np.testing.assert_array_equal(one, other)
        assert g.tolist() == [1e4, -2e4, 3e4]

    @EVERY
    def test_the_motion_is_continuous_and_in_equilibrium_at_every_tick(
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
    def test_the_first_state_of_the_march_is_the_initial_state(
        self, name: str, options: dict[str, float]
    ) -> None:
        problem = three()
        first = march(problem, name, 0.002, **options)[0]
        np.testing.assert_array_equal(first[DISPLACEMENT], problem.x0)
        np.testing.assert_allclose(first[VELOCITY], problem.v0, rtol=1e-10)

    @EVERY
    def test_a_structure_at_rest_stays_at_rest(self, name: str, options: dict[str, float]) -> None:
        problem = three()
        method = integrators.build(name, problem.M, problem.C, problem.K, 0.002, **options)
        s, zero = integrators.rest(3), np.zeros(3)
        np.testing.assert_array_equal(method.start(zero, zero, zero), s)
        integrators.step(method.code, method.coefficients, s, zero, 0.002)
        assert not s.any()

    @EVERY
    def test_uncoupled_storeys_move_as_single_ones(self, name: str, options: dict[str, float]) -> None:
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
    def test_an_unknown_method_is_refused(self) -> None:
        problem = single()
        with pytest.raises(InputError, match="did you mean kr_alpha"):
            integrators.build("kr_alfa", problem.M, problem.C, problem.K, 0.002)

    @pytest.mark.parametrize("rho", [-0.1, 1.1, math.nan])
    def test_a_spectral_radius_out_of_range_is_refused(self, rho: float) -> None:
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
