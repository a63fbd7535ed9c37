"""The adaptive model-based compensator: its rule, its convergence, and inputs that do not change it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from common.errors import InputError
from common.plan.laboratory_tables import Actuator
from models import compensators
from models.registry import Array
from tests.models.compensators.rig import DT, L, T, ask, clock, delay, drive, response, sine, waves

BAND = [(0.5, 0.004, 0.1), (1.1, 0.003, 1.0), (1.9, 0.003, 2.0), (2.9, 0.001, 3.0)]
LAG = {"a0": 1.0, "a1": L + T, "a2": L**2 / 2.0 + L * T, "a3": L**3 / 6.0 + L**2 * T / 2.0}
WRONG = {"a0": 1.1, "a1": 0.03, "a2": 2e-4, "a3": 1e-6}
GAINS = {"g0": 7.0, "g1": 4.5, "g2": 1.5, "g3": -2.0}
NOISE = np.random.default_rng(7).normal(0.0, 2e-5, 40_000)  # m; a displacement sensor's


def rule(start: Array, gains: Array, command: Array, measured: Array, cutoff: float) -> Array:
    """Coefficients after every tick: the gradient's implicit Euler step, solved as a linear system."""
    sections = signal.butter(4, cutoff, fs=1.0 / DT, output="sos")
    rest = signal.sosfilt_zi(sections)
    u = signal.sosfilt(sections, command, zi=rest * command[0])[0]
    x = signal.sosfilt(sections, measured, zi=rest * measured[0])[0]
    slope = np.array([1.0, -1.0]) / DT
    kernels = [np.ones(1), slope, np.convolve(slope, slope), np.convolve(np.convolve(slope, slope), slope)]
    x, u = np.concatenate([[x[0]] * 3, x]), np.concatenate([[u[0]] * 3, u])
    a, rows = start.copy(), [start.copy()]
    for k in range(4, x.size):
        phi = np.array([kernel @ x[k : k - kernel.size : -1] for kernel in kernels])
        pull = DT * gains[:, None] * np.outer(phi, phi) / (1.0 + phi @ phi)
        right = a + DT * gains * phi * u[k] / (1.0 + phi @ phi)
        a = np.maximum(np.linalg.solve(np.eye(4) + pull, right), 0.0)
        rows.append(a)
    return np.array(rows)


@pytest.mark.parametrize("gains", [[5.0, 2.0, -1.0, -4.0], [8.4, 6.2, 2.1, 0.8], [14.0, 12.0, 9.0, 6.0]])
def test_each_step_agrees_with_the_implicit_gradient_rule(gains: list[float]) -> None:
    g = {f"g{i}": gain for i, gain in enumerate(gains)}
    r, rate, bend, jerk = waves(BAND)(clock(1201))
    measured = waves([(0.7, 0.005, 0.4), (2.3, 0.002, 1.4)])(clock(1200) - 0.03)[0]
    built = compensators.build("amb", {**WRONG, **g, "trigger": 1e-12}, DT)
    got, commands = [], [r[0]]
    for k in range(1200):
        commands.append(ask(built, r[k + 1], rate[k + 1], bend[k + 1], jerk[k + 1], r[k], measured[k]))
        got.append(built.state[:4].copy())
    start = np.array(list(WRONG.values()))
    expected = rule(start, 10.0 ** np.array(gains), np.array(commands[:-1]), measured, 20.0)
    assert np.array(got) == pytest.approx(expected, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("noise", [None, NOISE])
def test_amb_converges_to_the_inverse_of_another_actuator(noise: Array | None) -> None:
    run = drive("amb", {**WRONG, **GAINS}, waves(BAND), 20_000, noise=noise)
    for frequency, _, _ in BAND:
        got = response(run, frequency, 10.0)
        assert abs(delay(got, frequency)) <= 0.001
        assert abs(got) == pytest.approx(1.0, abs=0.02)


def test_amb_tracks_with_an_actuator_of_another_gain() -> None:
    actuator = Actuator(gain=0.9, delay=0.020, time_constant=0.025)
    run = drive("amb", {**LAG, **GAINS}, waves(BAND), 20_000, actuator)
    assert run.coefficients[-1, 0] == pytest.approx(1.0 / 0.9, rel=0.02)
    assert run.coefficients[-1, 1] == pytest.approx(0.045 / 0.9, rel=0.03)


def test_commands_and_measurements_are_paired_by_time() -> None:
    """An actuator that reaches every command on time has the inverse 1, 0; a tick's slip would be a1 = DT."""
    built = compensators.build("amb", {"a0": 1.0, "a1": 0.0, "a2": 0.0, "a3": 0.0, **GAINS}, DT)
    r, rate, bend, jerk = waves(BAND)(clock(6001))
    reached = float(r[0])
    for k in range(6000):
        reached = ask(built, r[k + 1], rate[k + 1], bend[k + 1], jerk[k + 1], r[k], reached)
    assert built.state[:2] == pytest.approx([1.0, 0.0], abs=2e-5)


@given(
    seed=st.integers(0, 2**32 - 1),
    size=st.floats(-7.0, 7.0),
    exponents=st.lists(st.floats(-20.0, 20.0), min_size=4, max_size=4),
)
@settings(max_examples=25, deadline=None)
def test_coefficients_stay_finite_and_positive_whatever_is_measured(
    seed: int, size: float, exponents: list[float]
) -> None:
    numbers = np.random.default_rng(seed).normal(0.0, 10.0**size, (600, 6))
    built = compensators.build("amb", {f"g{i}": value for i, value in enumerate(exponents)}, DT)
    for r, rate, bend, jerk, present, measured in numbers.tolist():
        assert np.isfinite(ask(built, r, rate, bend, jerk, present, measured))
        assert np.isfinite(built.state[:4]).all()
        assert (built.state[:4] >= 0.0).all()


@given(exponents=st.lists(st.floats(0.0, 20.0), min_size=4, max_size=4))
@settings(max_examples=25, deadline=None)
def test_adaptation_gains_of_any_size_keep_the_true_inverse(exponents: list[float]) -> None:
    """A static actuator of gain one has the inverse 1, 0, 0, 0, where every error is zero up to rounding."""
    gains = {f"g{i}": value for i, value in enumerate(exponents)}
    built = compensators.build("amb", {"a0": 1.0, "a1": 0.0, "a2": 0.0, "a3": 0.0, **gains}, DT)
    r, rate, bend, jerk = waves(BAND)(clock(2001))
    reached = float(r[0])
    for k in range(2000):
        reached = ask(built, r[k + 1], rate[k + 1], bend[k + 1], jerk[k + 1], r[k], reached)
        assert reached == pytest.approx(r[k + 1], abs=1e-9)


@pytest.mark.parametrize("offset", [0.0, 0.004])
def test_noise_alone_does_not_change_the_coefficients(offset: float) -> None:
    run = drive("amb", {}, sine(1.0, 0.0), 20_000, noise=NOISE + offset)
    assert (run.coefficients == run.coefficients[0]).all()


def test_after_the_motion_the_coefficients_stay_constant() -> None:
    def burst(time: Array) -> tuple[Array, Array, Array, Array]:
        rows = [row * (time < 4.0) for row in sine(1.0, 0.004)(time)]
        return rows[0], rows[1], rows[2], rows[3]

    run = drive("amb", {**LAG, **GAINS}, burst, 10_000, noise=NOISE)
    assert np.ptp(run.coefficients[:2000], axis=0).all()
    tail = run.coefficients[round(4.8 / DT) :]
    assert (tail == tail[0]).all()


def test_a_nan_measurement_freezes_the_coefficients() -> None:
    built = compensators.build("amb", {}, DT)
    start = built.state[:4].copy()
    for k in range(500):
        assert np.isfinite(ask(built, 0.01, measured=np.nan if k == 0 else 0.01 * (k % 50)))
    assert (built.state[:4] == start).all()


def test_an_impossible_filter_is_refused() -> None:
    with pytest.raises(InputError, match="cutoff of compensator 'amb' is 250, but must be below 250 Hz"):
        compensators.build("amb", {"cutoff": 250.0}, DT)
