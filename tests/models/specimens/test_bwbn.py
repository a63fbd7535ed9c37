"""The degrading, pinching column against Bouc and Wen's, an adaptive solver and closed forms."""

from __future__ import annotations

import math
from itertools import pairwise
from time import process_time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from common.errors import InputError
from models import specimens
from models.registry import Array
from models.specimens import bwbn

K, DY = 12.5e6, 0.008  # N/m, m
BASE = {"stiffness": K, "yield_displacement": DY, "hardening": 0.05}
PLAIN = {"delta_nu": 0.0, "delta_eta": 0.0, "zeta_s": 0.0}
CORNERS = np.array([0.0, 2.0, -1.0, 0.7, -3.0, 4.0, 3.5, 3.8, -0.2, 6.0, -6.0]) * DY


def run(path: Array, **params: float) -> tuple[Array, Array]:
    """Force (N) and memory at every point of a path."""
    kind, p, s = specimens.pack("bwbn", **(BASE | params))
    force, memory = np.empty(path.size), np.empty((path.size, bwbn.STATE_SIZE))
    for i, x in enumerate(path):
        force[i] = specimens.step(kind, p, s, float(x))
        memory[i] = s[: bwbn.STATE_SIZE]
    return force, memory


def through(corners: Array, steps: int) -> Array:
    parts = [np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(corners)]
    return np.concatenate([corners[:1], *parts])


@pytest.mark.parametrize("n", [1.0, 1.7, 2.0, 5.0])
@pytest.mark.parametrize(("beta", "gamma"), [(0.5, 0.5), (0.9, -0.3), (0.1, 0.9), (2.0, 1.0)])
@pytest.mark.parametrize("steps", [1, 30])
def test_without_degradation_and_pinching_bwbn_equals_bouc_wen(
    n: float, beta: float, gamma: float, steps: int
) -> None:
    path = through(CORNERS, steps)
    kind, p, s = specimens.pack("bouc_wen", **BASE, n=n, beta=beta, gamma=gamma)
    expected = [specimens.step(kind, p, s, float(x)) for x in path]
    found, _ = run(path, n=n, beta=beta, gamma=gamma, **PLAIN)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * K * DY)


@pytest.mark.parametrize(
    "params",
    [
        {},
        {"n": 1.0, "delta_nu": 0.1, "delta_eta": 0.2, "zeta_s": 0.0},
        {"n": 1.3, "beta": 1.3, "gamma": -0.3, "zeta_s": 0.9, "p": 2.0, "psi": 0.2, "q": -0.3},
        {"n": 3.0, "beta": 0.2, "gamma": 0.8, "delta_nu": 0.3, "delta_psi": 0.1, "lambda_": 1.0},
    ],
)
def test_the_model_agrees_with_an_adaptive_solver_of_order_eight(params: dict[str, float]) -> None:
    _, p, _ = specimens.pack("bwbn", **(BASE | params))
    q = bwbn.BwbnParams(*p.tolist())
    state, expected = np.zeros(2), []
    for a, b in pairwise(CORNERS):

        def rate(_way: float, y: Array, sign: float = float(np.sign(b - a))) -> Array:
            z, energy = y
            nu, eta = 1.0 + q.delta_nu * energy, 1.0 + q.delta_eta * energy
            depth = q.zeta_s * (1.0 - math.exp(-q.p * energy))
            width = (q.psi + q.delta_psi * energy) * (q.lambda_ + depth)
            bound = (1.0 / (nu * (q.beta + q.gamma))) ** (1.0 / q.n)
            pinch = 1.0 - depth * math.exp(-((z * sign - q.q * bound) ** 2) / width**2)
            flow = 1.0 - nu * abs(z) ** q.n * (q.beta * np.sign(z * sign) + q.gamma)
            return np.array([sign * pinch * flow / eta, sign * 0.95 * z])

        way = abs(b - a) / DY
        solution = solve_ivp(rate, (0.0, way), state, method="DOP853", rtol=1e-10, atol=1e-11, max_step=0.02)
        state = solution.y[:, -1]
        expected.append(0.05 * K * b + 0.95 * K * DY * state[0])
    once, memory = run(CORNERS[1:], **params)
    np.testing.assert_allclose(once, expected, rtol=0, atol=2e-6 * K * DY)
    assert memory[-1, bwbn.ENERGY] == pytest.approx(state[1], abs=1e-5)
    many, _ = run(through(CORNERS, 50)[1:], **params)
    np.testing.assert_allclose(many[49::50], expected, rtol=0, atol=2e-6 * K * DY)


def test_energy_is_the_work_of_the_hysteretic_spring() -> None:
    path = through(CORNERS, 4000)
    force, memory = run(path)
    plastic = force - 0.05 * K * path
    work = float(np.sum(0.5 * (plastic[1:] + plastic[:-1]) * np.diff(path)))
    assert memory[-1, bwbn.ENERGY] * K * DY**2 == pytest.approx(work, rel=1e-5)


def test_strength_degrades_as_in_the_closed_form() -> None:
    # far out z = (ν·(β + γ))^(−1/n), and ν follows from the energy
    _, memory = run(np.array([200.0 * DY]), delta_nu=0.05)
    _, z, energy = memory[0]
    assert z == pytest.approx((1.0 + 0.05 * energy) ** -0.5, rel=2e-3)
    _, stepped = run(np.linspace(0.0, 200.0 * DY, 500), delta_nu=0.05)
    # one increment ends on the bound itself, which z follows from a little above
    np.testing.assert_allclose(memory[0], stepped[-1], rtol=2e-3)


def test_pinching_and_degradation_make_loops_thinner_and_softer() -> None:
    path = through(np.array([0.0] + [4.0, -4.0] * 8 + [4.0]) * DY, 300)

    def areas(**params: float) -> Array:
        force, _ = run(path, **params)
        work = np.cumsum(np.append(0.0, 0.5 * (force[1:] + force[:-1]) * np.diff(path)))
        return np.diff(work[300::600])

    plain, pinched = areas(**PLAIN), areas(delta_nu=0.0, delta_eta=0.0, zeta_s=0.8, p=1.0)
    np.testing.assert_allclose(plain[1:], plain[1], rtol=1e-6)
    assert np.all(pinched[1:] < 0.9 * plain[1:])
    weaker = areas(delta_nu=0.05, delta_eta=0.0, zeta_s=0.0)
    assert np.all(np.diff(weaker[1:]) < 0.0)


def test_an_increment_of_any_size_takes_a_bounded_time() -> None:
    kind, p, s = specimens.pack("bwbn", **BASE, psi=0.01, n=50.0)
    specimens.step(kind, p, s, DY)
    began = process_time()
    force = [specimens.step(kind, p, s, x) for x in (1e9, -1e12, 1e300, 0.0, math.inf)]
    assert process_time() - began < 60.0  # of this process; an unbounded one would not end
    assert np.isfinite(force[:-1]).all()


@settings(max_examples=50)
@given(
    st.lists(st.floats(-10.0 * DY, 10.0 * DY), min_size=1, max_size=20),
    st.floats(1.0, 6.0),
    st.floats(0.05, 2.0),
    st.floats(0.0, 0.3),
    st.floats(0.0, 0.99),
    st.floats(-1.0, 1.0),
)
def test_forces_are_finite_and_dissipated_energy_is_never_negative(
    path: list[float], n: float, beta: float, degradation: float, depth: float, q: float
) -> None:
    force, memory = run(
        np.array(path),
        n=n,
        beta=beta,
        gamma=1.0 - beta,
        delta_nu=degradation,
        delta_eta=degradation,
        zeta_s=depth,
        q=q,
    )
    assert np.isfinite(force).all()
    assert memory[:, bwbn.ENERGY].min() >= -1e-6


def test_parameters_that_no_column_can_have_are_refused() -> None:
    for params in ({"gamma": -0.5}, {"zeta_s": 1.0}, {"psi": 0.0}, {"delta_eta": -1.0}):
        with pytest.raises(InputError):
            run(np.zeros(1), **params)
