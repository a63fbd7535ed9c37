"""Specimen models: properties of all models in the registry, and each model against closed forms."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from common.errors import InputError
from models import specimens
from models.registry import Array
from models.specimens import SPECIMENS, STATE_SIZE, bouc_wen, pinched

K, DY = 12.5e6, 0.008  # N/m, m

PINCHED = {
    "stiffness": K,
    "yield_displacement": DY,
    "hardening": 0.05,
    "first_bend": 0.5,
    "second_stiffness": 0.4,
    "pinch_force": 0.3,
    "pinch_displacement": 0.6,
    "unloading": 0.3,
    "damage": 0.02,
}
EXAMPLES: dict[str, dict[str, float]] = {
    "linear": {"stiffness": K},
    "bilinear": {"stiffness": K, "yield_displacement": DY, "hardening": 0.1},
    "bouc_wen": {"stiffness": K, "yield_displacement": DY, "hardening": 0.05, "n": 2.0},
    "clough": {
        "stiffness": K,
        "yield_displacement": DY,
        "hardening": 0.05,
        "unloading": 0.4,
        "crack_displacement": 0.2 * DY,
        "closing": 0.3,
    },
    "bwbn": {"stiffness": K, "yield_displacement": DY, "hardening": 0.05},
    "menegotto_pinto": {"stiffness": K, "yield_displacement": DY, "hardening": 0.05, "sharpness": 18.0},
    "pinched": PINCHED,
    "pinched_by_peak": PINCHED | {"pinch_displacement": 0.4},
    "pinched_by_rest": PINCHED,
    "trilinear": {"stiffness": K, "yield_displacement": DY, "hardening": 0.05},
    "self_centring": {"stiffness": K, "yield_displacement": DY, "hardening": 0.1, "loop": 0.6},
    "layered": {"stiffness": K, "yield_displacement": DY},
    "slider": {"stiffness": K, "push": K * DY, "pull": K * DY},
}

CORNERS = {
    "pinched": pinched.ON_THE_WAY,
    "pinched_by_peak": pinched.BY_PEAK,
    "pinched_by_rest": pinched.BY_REST,
}  # models of one file


def forces(name: str, path: Array, **params: float) -> Array:
    kind, p, s = specimens.pack(name, **(EXAMPLES[name] | params))
    return np.array([specimens.step(kind, p, s, float(x)) for x in path])


def cycles(amplitude: float, count: int, steps: int) -> Array:
    """From zero, `count` full cycles between ±amplitude on straight lines of `steps` points per quarter."""
    corners = [0.0] + [amplitude, -amplitude] * count + [amplitude]
    parts = [np.linspace(a, b, steps * (1 if a == 0.0 else 2) + 1)[1:] for a, b in pairwise(corners)]
    return np.concatenate([[0.0], *parts])


def work(force: Array, path: Array) -> float:
    return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(path)))


class TestRegistry:
    def test_codes_are_distinct_and_every_model_has_an_example(self) -> None:
        assert sorted(model.code for model in SPECIMENS.values()) == list(range(len(SPECIMENS)))
        assert EXAMPLES.keys() == SPECIMENS.keys()

    @pytest.mark.parametrize("name", SPECIMENS)
    def test_stiffness_comes_first_and_every_parameter_has_a_range(self, name: str) -> None:
        model = SPECIMENS[name]
        assert model.params._fields[0] == "stiffness"
        assert tuple(model.rules) == model.params._fields
        assert model.state_size <= STATE_SIZE

    @pytest.mark.parametrize("name", SPECIMENS)
    def test_dispatch_equals_the_model_itself(self, name: str) -> None:
        from importlib import import_module

        corner = CORNERS.get(name)
        module = import_module(f"models.specimens.{name if corner is None else 'pinched'}")
        more = () if corner is None else (corner,)
        path = cycles(3 * DY, 1, 10)
        _, p, s = specimens.pack(name, **EXAMPLES[name])
        assert [module.step(p, s, x, *more) for x in path] == forces(name, path).tolist()

    @pytest.mark.parametrize("name", SPECIMENS)
    def test_every_model_starts_elastic_and_is_odd(self, name: str) -> None:
        small = np.array([1e-7 * DY])
        np.testing.assert_allclose(forces(name, small), K * small, rtol=1e-6)
        path = cycles(2.5 * DY, 2, 17)
        np.testing.assert_array_equal(forces(name, -path), -forces(name, path))

    @pytest.mark.parametrize("name", SPECIMENS)
    def test_repeated_runs_are_equal_and_zero_increments_change_nothing(self, name: str) -> None:
        path = cycles(2.5 * DY, 2, 17)
        np.testing.assert_array_equal(forces(name, path), forces(name, path))
        np.testing.assert_array_equal(forces(name, np.repeat(path, 3))[::3], forces(name, path))

    @pytest.mark.parametrize("name", SPECIMENS)
    @pytest.mark.parametrize("steps", [1, 2, 7, 200])
    def test_the_force_does_not_depend_on_the_subdivision_of_increments(self, name: str, steps: int) -> None:
        coarse, fine = cycles(4 * DY, 3, steps), cycles(4 * DY, 3, 10 * steps)
        expected = forces(name, fine)[::10]
        exact = 1e-3 if name == "layered" else 1e-6  # layers go their own ways within an increment
        np.testing.assert_allclose(forces(name, coarse), expected, atol=exact * K * DY, rtol=0)

    @pytest.mark.parametrize("name", SPECIMENS)
    def test_any_increment_gives_a_finite_force(self, name: str) -> None:
        path = np.array([0.0, 1e3, -1e6, 1e-300, 1e9, 0.0, -5e-324, DY])
        assert np.all(np.isfinite(forces(name, path)))

    @pytest.mark.parametrize("name", SPECIMENS)
    def test_a_nan_deformation_does_not_hang(self, name: str) -> None:
        assert math.isnan(forces(name, np.array([math.nan]))[0])
        forces(name, np.array([math.inf, 0.0]))

    @pytest.mark.parametrize("name", SPECIMENS)
    def test_closed_cycles_never_return_work(self, name: str) -> None:
        for amplitude in (0.3 * DY, DY, 3 * DY):
            path = cycles(amplitude, 3, 2000)
            one = 4 * 2000
            force = forces(name, path)
            assert work(force[-one - 1 :], path[-one - 1 :]) >= -1e-9 * K * DY**2


class TestPack:
    def test_parameters_are_packed_in_order_with_the_memory_at_rest(self) -> None:
        kind, p, s = specimens.pack("bilinear", hardening=0.1, yield_displacement=DY, stiffness=K)
        assert (kind, p.tolist(), s.tolist()) == (1, [K, DY, 0.1], [0.0] * STATE_SIZE)
        assert p.dtype == s.dtype == np.float64
        assert p.flags.c_contiguous

    def test_the_default_parameters_are_the_common_ones(self) -> None:
        assert specimens.pack("bouc_wen", stiffness=K, yield_displacement=DY)[1].tolist() == [
            K,
            DY,
            0.0,
            2.0,
            0.5,
            0.5,
        ]

    @pytest.mark.parametrize(
        ("name", "params", "says"),
        [
            ("bilnear", {"stiffness": K}, "did you mean bilinear"),
            ("linear", {}, "'stiffness' .* missing"),
            ("linear", {"stifness": K}, "did you mean stiffness"),
            ("linear", {"stiffness": -1.0}, "at least 0 N/m"),
            ("linear", {"stiffness": math.nan}, "finite"),
            ("bilinear", {"stiffness": K}, "'yield_displacement' .* missing"),
            ("bilinear", {"stiffness": K, "yield_displacement": 0.0}, "above 0 m"),
            ("bilinear", {"stiffness": K, "yield_displacement": DY, "hardening": 1.5}, "at most 1"),
            ("bouc_wen", {"stiffness": K, "yield_displacement": DY, "n": 0.5}, "at least 1"),
            ("bouc_wen", {"stiffness": K, "yield_displacement": DY, "beta": 0.0}, "above 0"),
            ("bouc_wen", {"stiffness": K, "yield_displacement": DY, "gamma": -0.5}, "beta \\+ gamma"),
        ],
    )
    def test_parameters_that_no_column_can_have_are_refused(
        self, name: str, params: dict[str, float], says: str
    ) -> None:
        with pytest.raises(InputError, match=says):
            specimens.pack(name, **params)


def test_the_linear_model_gives_stiffness_times_deformation() -> None:
    path = np.random.default_rng(1).standard_normal(100)
    np.testing.assert_array_equal(forces("linear", path), K * path)


class TestBilinear:
    @pytest.mark.parametrize("alpha", [0.0, 0.02, 0.3])
    @pytest.mark.parametrize("ductility", [1.0, 1.5, 4.0])
    def test_the_energy_of_a_cycle_agrees_with_the_closed_form(self, alpha: float, ductility: float) -> None:
        # the force is a straight line between the corners only where steps meet them
        path = cycles(ductility * DY, 3, 1200)
        force = forces("bilinear", path, hardening=alpha)
        one = 4 * 1200
        expected = 4.0 * (1.0 - alpha) * K * DY * (ductility - 1.0) * DY
        assert work(force[-one - 1 :], path[-one - 1 :]) == pytest.approx(expected, rel=1e-5, abs=1e-6)

    def test_the_corners_of_the_loop_agree_with_the_closed_form(self) -> None:
        # hand calculation with k = 1, δ_y = 1, α = 0.1: yields at 1, unloads by 2, then hardens backwards
        path = np.array([0.5, 1.0, 3.0, 1.0, -3.0, -1.0, 0.0, 3.0])
        force = forces("bilinear", path, stiffness=1.0, yield_displacement=1.0, hardening=0.1)
        np.testing.assert_allclose(force, [0.5, 1.0, 1.2, -0.8, -1.2, 0.8, 0.9, 1.2], rtol=1e-14)

    def test_without_yielding_the_model_is_linear(self) -> None:
        path = np.random.default_rng(2).uniform(-DY, DY, 100)
        path = 0.999 * path / np.abs(path).max() * DY
        np.testing.assert_allclose(forces("bilinear", path), K * path, rtol=1e-11, atol=1e-6)


class TestSlider:
    def test_a_cycle_is_a_parallelogram_with_play_between_the_flanks(self) -> None:
        # hand calculation with k = 1, w = 1: it slides at 2 or at −1, and carries nothing within the play
        path = np.array([0.5, 1.5, 2.5, 4.0, 2.5, 1.0, 0.5, 0.0, -3.0])
        force = forces("slider", path, stiffness=1.0, push=2.0, pull=1.0, play=1.0)
        np.testing.assert_allclose(force, [0.0, 1.0, 2.0, 2.0, 0.5, 0.0, -0.5, -1.0, -1.0], atol=1e-14)

    @pytest.mark.parametrize("corner", [0.02 * DY, 0.2 * DY])
    @pytest.mark.parametrize("play", [0.0, 0.1 * DY, DY])
    def test_with_round_corners_it_slides_at_the_friction_for_any_increment(
        self, corner: float, play: float
    ) -> None:
        shape = {"push": 0.7 * K * DY, "pull": 0.9 * K * DY, "play": play, "corner": corner}
        coarse, fine = cycles(4 * DY, 2, 1), cycles(4 * DY, 2, 200)
        force = forces("slider", fine, **shape)
        np.testing.assert_allclose(force.max(), 0.7 * K * DY, rtol=1e-9)
        np.testing.assert_allclose(force.min(), -0.9 * K * DY, rtol=1e-9)
        np.testing.assert_allclose(forces("slider", coarse, **shape), force[::200], atol=1e-6 * K * DY)

    def test_the_play_takes_its_width_from_every_half_cycle(self) -> None:
        path = cycles(4 * DY, 3, 2000)
        tight, loose = (forces("slider", path, play=play) for play in (0.0, DY))
        one = 4 * 2000 + 1
        lost = work(tight[-one:], path[-one:]) - work(loose[-one:], path[-one:])
        assert lost == pytest.approx(2.0 * K * DY * DY, rel=1e-3)


class TestBoucWen:
    @pytest.mark.parametrize("n", [1.0, 1.7, 2.0, 5.0])
    @pytest.mark.parametrize(("beta", "gamma"), [(0.5, 0.5), (0.8, 0.2), (0.9, -0.3), (0.1, 0.9), (2.0, 1.0)])
    def test_the_model_agrees_with_an_adaptive_solver_of_order_eight(
        self, n: float, beta: float, gamma: float
    ) -> None:
        corners = np.array([0.0, 2.0, -1.0, 0.7, -3.0, 4.0, 3.5, 3.8, -0.2]) * DY
        z, expected = 0.0, []
        for a, b in pairwise(corners):

            def rate(_way: float, state: Array, sign: float = float(np.sign(b - a))) -> Array:
                turn = gamma + beta * np.sign(sign * state)
                return np.asarray(sign * (1.0 - np.abs(state) ** n * turn))

            solution = solve_ivp(
                rate, (0.0, abs(b - a) / DY), [z], method="DOP853", rtol=1e-11, atol=1e-12, max_step=0.01
            )
            z = float(solution.y[0, -1])
            expected.append(0.05 * K * b + 0.95 * K * DY * z)
        one_step = forces("bouc_wen", corners[1:], n=n, beta=beta, gamma=gamma)
        np.testing.assert_allclose(one_step, expected, rtol=0, atol=1e-6 * K * DY)
        ticks = np.concatenate([np.linspace(a, b, 101)[1:] for a, b in pairwise(corners)])
        many_steps = forces("bouc_wen", ticks, n=n, beta=beta, gamma=gamma)[99::100]
        np.testing.assert_allclose(many_steps, expected, rtol=0, atol=1e-6 * K * DY)

    def test_first_loading_agrees_with_the_closed_form(self) -> None:
        x = np.linspace(0.0, 3.0, 50)[1:]
        rounded = forces("bouc_wen", x * DY, hardening=0.0, n=2.0)
        np.testing.assert_allclose(rounded / (K * DY), np.tanh(x), atol=1e-7)
        exponential = forces("bouc_wen", x * DY, hardening=0.0, n=1.0)
        np.testing.assert_allclose(exponential / (K * DY), 1.0 - np.exp(-x), atol=1e-7)

    @pytest.mark.parametrize("n", [1.0, 2.0, 3.5, 20.0])
    @pytest.mark.parametrize(("beta", "gamma"), [(0.5, 0.5), (3.0, 1.0), (0.3, -0.2), (0.1, 0.1)])
    def test_the_ultimate_force_agrees_with_the_closed_form(
        self, n: float, beta: float, gamma: float
    ) -> None:
        alpha, far = 0.05, 1000.0 * DY
        bound = (beta + gamma) ** (-1.0 / n)
        force = forces("bouc_wen", np.array([far, -far]), n=n, beta=beta, gamma=gamma)
        expected = alpha * K * far + (1.0 - alpha) * K * DY * bound
        np.testing.assert_allclose(force, [expected, -expected], rtol=1e-12)

    def test_bouc_wen_with_a_large_n_approaches_bilinear(self) -> None:
        path = cycles(3 * DY, 2, 100)
        expected = forces("bilinear", path, hardening=0.05)
        gaps = [
            np.abs(forces("bouc_wen", path, hardening=0.05, n=n) - expected).max() / (K * DY)
            for n in (5.0, 20.0, 100.0, 500.0)
        ]
        assert gaps == sorted(gaps, reverse=True)
        assert gaps[-1] < 0.005

    def test_hysteretic_force_never_exceeds_its_bound(self) -> None:
        kind, p, s = specimens.pack("bouc_wen", **EXAMPLES["bouc_wen"])
        for x in np.random.default_rng(4).standard_normal(5000) * 3 * DY:
            specimens.step(kind, p, s, float(x))
            assert abs(s[bouc_wen.HYSTERETIC]) <= 1.0 + 1e-12


def test_noise_in_a_motion_starts_no_branch_of_menegotto_and_pinto() -> None:
    rising = np.linspace(0.0, 4.0 * DY, 400)
    shaken = np.repeat(rising, 2)
    shaken[3::2] -= 5e-5 * DY
    smooth, turning, held = (
        forces("menegotto_pinto", rising),
        forces("menegotto_pinto", shaken)[::2],
        forces("menegotto_pinto", shaken, least_turn=3e-4)[::2],
    )
    assert np.array_equal(held, smooth)
    assert np.max(np.abs(turning - smooth)) > 0.01 * K * DY


def test_a_branch_of_menegotto_and_pinto_begins_at_a_reversal_of_the_least_size() -> None:
    path = DY * np.concatenate([np.linspace(0.0, 3.0, 50), np.linspace(2.9, -3.0, 60)])
    exact, coarse = (forces("menegotto_pinto", path, least_turn=least) for least in (0.0, 0.05))
    assert np.array_equal(exact, coarse)


@pytest.mark.parametrize("name", ["pinched", "pinched_by_peak", "pinched_by_rest"])
def test_a_pinched_specimen_is_stronger_on_one_side_by_its_asymmetry(name: str) -> None:
    size, far = 0.3, 10.0 * DY
    up = forces(name, np.linspace(0.0, far, 200), asymmetry=size)
    down = forces(name, np.linspace(0.0, -far, 200), asymmetry=size)
    for force, side in ((up[-1], 1.0 + size), (-down[-1], 1.0 - size)):
        bent = 0.5 * DY + 0.4 * 0.5 * DY  # of the skeleton where its third line begins, times k
        assert force == pytest.approx(K * (side * bent + 0.05 * (far - side * DY)))
    path = DY * np.concatenate(
        [4.0 * np.sin(np.linspace(0.0, 7.0, 300)), 2.0 * np.sin(np.linspace(7.0, 30.0, 900))]
    )
    np.testing.assert_allclose(
        forces(name, path, asymmetry=size), -forces(name, -path, asymmetry=-size), rtol=1e-12
    )
