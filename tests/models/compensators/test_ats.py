"""The adaptive time series: its convergence, and the bounds on its coefficients."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import InputError
from common.plan.laboratory_tables import Actuator
from models import compensators
from models.compensators import ats
from models.registry import Array
from tests.models.compensators.rig import (
    DT,
    L,
    Motion,
    T,
    ask,
    clock,
    delay,
    drive,
    response,
    sine,
    waves,
)

BAND = [(0.5, 0.004, 0.1), (1.1, 0.003, 1.0), (1.9, 0.003, 2.0), (2.9, 0.001, 3.0)]
TRUE = [1.0, L + T, L**2 / 2.0 + L * T]
NOISE = np.random.default_rng(7).normal(0.0, 2e-5, 40_000)  # m; a displacement sensor's


def then_still(motion: Motion, end: float, offset: float = 0.0) -> Motion:
    """A motion faded in and out over half a second each, still at an offset (m) after `end` s."""

    def at(time: Array) -> tuple[Array, Array, Array, Array]:
        fade = np.clip(np.minimum(time, end - time) / 0.5, 0.0, 1.0)
        fade = fade**3 * (10.0 - 15.0 * fade + 6.0 * fade**2)
        rest = offset * np.clip(time / end, 0.0, 1.0)
        r = fade * motion(time)[0] + rest
        rate = np.gradient(r, DT)
        bend = np.gradient(rate, DT)
        return r, rate, bend, np.gradient(bend, DT)

    return at


@pytest.mark.parametrize("lead", [0.0, 0.02, 0.044, 0.07])
@pytest.mark.parametrize("noise", [None, NOISE])
def test_ats_converges_to_the_inverse_from_any_start(lead: float, noise: Array | None) -> None:
    run = drive("ats", {"lead": lead}, waves(BAND), 8000, noise=noise)
    a0, a1, a2 = run.coefficients[-1]
    assert a0 == pytest.approx(TRUE[0], abs=0.005)
    assert a1 == pytest.approx(TRUE[1], abs=0.001)
    assert a2 == pytest.approx(TRUE[2], rel=0.05)
    for frequency, _, _ in BAND:
        got = response(run, frequency, 10.0)
        assert abs(delay(got, frequency)) <= 0.001
        assert abs(got) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("noise", [None, NOISE])
@pytest.mark.parametrize("frequency", [0.5, 1.0, 2.0, 3.0])
def test_a_single_sine_is_tracked_although_it_does_not_determine_a0_and_a2_separately(
    frequency: float, noise: Array | None
) -> None:
    run = drive("ats", {"lead": 0.02}, sine(frequency, 0.005), 8000, noise=noise)
    got = response(run, frequency)
    assert abs(delay(got, frequency)) <= 1e-4
    assert abs(got) == pytest.approx(1.0, abs=0.001)


def test_the_coefficients_do_not_depend_on_their_start() -> None:
    ends = [drive("ats", {"lead": lead}, waves(BAND), 8000).coefficients[-1] for lead in (0.02, 0.07)]
    assert ends[0] == pytest.approx(ends[1], rel=1e-6)


def test_ats_tracks_with_an_actuator_that_is_not_the_nominal_one() -> None:
    actuator = Actuator(gain=0.9, delay=0.020, time_constant=0.025)
    a0, a1, _ = drive("ats", {}, waves(BAND), 8000, actuator).coefficients[-1]
    assert a0 == pytest.approx(1.0 / 0.9, rel=0.01)
    assert a1 == pytest.approx(0.045 / 0.9, rel=0.03)


def test_commands_and_measurements_are_paired_by_time() -> None:
    """An actuator that reaches every command on time has the inverse 1, 0, 0; a tick's slip would be a1 = DT."""
    built = compensators.build("ats", {"lead": 0.02}, DT)
    r, rate, bend, _ = waves(BAND)(clock(6001))
    reached = 0.0
    for k in range(6000):
        reached = ask(built, r[k + 1], rate[k + 1], bend[k + 1], present=r[k], measured=reached)
    assert built.state[:3] == pytest.approx([1.0, 0.0, 0.0], abs=2e-5)


@given(seed=st.integers(0, 2**32 - 1), size=st.floats(-7.0, 7.0), jumps=st.booleans())
@settings(max_examples=25, deadline=None)
def test_bounds_on_coefficients_and_their_rates_hold_whatever_is_measured(
    seed: int, size: float, jumps: bool
) -> None:
    rng = np.random.default_rng(seed)
    numbers = rng.normal(0.0, 10.0**size, (1500, 5))
    if jumps:
        numbers *= 10.0 ** rng.integers(-6, 6, (1500, 1))
    built = compensators.build("ats", {"window": 0.4}, DT)
    rows = [built.state[:3].copy()]
    for row in numbers:
        command = ask(built, row[0], row[1], row[2], 0.0, row[3], row[4])
        assert np.isfinite(command)
        rows.append(built.state[:3].copy())
    path = np.array(rows)
    assert (path >= [0.7, 0.0, 0.0]).all()
    assert (path <= [1.3, 0.08, 0.0032]).all()
    assert (np.abs(np.diff(path, axis=0)) <= np.array([2.0, 0.05, 0.001]) * DT + 1e-15).all()


def test_below_the_trigger_the_coefficients_are_frozen() -> None:
    run = drive("ats", {"lead": 0.02}, sine(1.0, 0.00045), 5000)
    assert np.abs(run.measured).max() < 0.0005
    assert (run.coefficients == run.coefficients[0]).all()
    run = drive("ats", {"lead": 0.02, "trigger": 0.0001}, sine(1.0, 0.00045), 5000)
    assert run.coefficients[-1, 1] == pytest.approx(0.044, abs=0.001)


@pytest.mark.parametrize("offset", [0.0, 0.004])
def test_a_quiet_tail_does_not_change_the_coefficients(offset: float) -> None:
    """30 s of noise after the motion, also with the specimen left deformed far above the trigger."""
    motion = then_still(waves(BAND), 8.0, offset)
    run = drive("ats", {}, motion, 20_000, noise=NOISE)
    moved, tail = run.coefficients[3500], run.coefficients[round(8.4 / DT) :]
    assert (tail == tail[0]).all()
    assert tail[0] == pytest.approx(moved, rel=0.05)
    assert run.command[round(8.4 / DT) :] == pytest.approx(
        np.full(tail.shape[0], tail[0, 0] * offset), abs=1e-9
    )


def test_a_decaying_free_vibration_ends_in_frozen_coefficients() -> None:
    """The inverse is accurate at the pole of the vibration; the fit includes noise near the trigger."""
    pole = 2.0 * np.pi * (-0.04 + 1j) * 1.6

    def decay(time: Array) -> tuple[Array, Array, Array, Array]:
        rows = [(0.008 * pole**order * np.exp(pole * time)).imag for order in range(4)]
        return rows[0], rows[1], rows[2], rows[3]

    run = drive("ats", {"lead": 0.03}, decay, 15_000, noise=NOISE)
    tail = run.coefficients[round(8.0 / DT) :]
    assert (tail == tail[0]).all()
    actuator = np.exp(-pole * L) / (1.0 + pole * T)
    left = complex(actuator * (tail[0] @ np.array([1.0, pole, pole * pole])))
    assert abs(delay(left, 1.6)) <= 0.001
    assert abs(left) == pytest.approx(1.0, abs=0.02)


def test_noise_alone_does_not_change_the_coefficients() -> None:
    run = drive("ats", {}, sine(1.0, 0.0), 20_000, noise=NOISE + 0.003)
    assert (run.coefficients == run.coefficients[0]).all()


def test_the_running_sums_do_not_drift() -> None:
    """Kilometres first, millimetres after: two windows later nothing is left of the large numbers."""
    built = compensators.build("ats", {"window": 0.5}, DT)
    length = int(built.params[ats.LENGTH])
    rng = np.random.default_rng(3)
    for k in range(6000):
        r = rng.normal(0.0, 1e3 if k < 3000 else 1e-3, 5)
        ask(built, r[0], r[1], r[2], 0.0, r[3], r[4])
    rows = built.state[ats.RING :].reshape(length, 4)
    x, v, a, u = rows.T
    exact = [x @ x, x @ v, x @ a, v @ v, v @ a, a @ a, x @ u, v @ u, a @ u, x.sum()]
    scale = np.abs(exact).max()
    assert built.state[ats.SUMS : ats.SUMS + 10] == pytest.approx(exact, rel=1e-9, abs=1e-12 * scale)


def test_a_window_of_constant_values_keeps_the_coefficients() -> None:
    built = compensators.build("ats", {}, DT)
    start = built.state[:3].copy()
    for _ in range(1500):
        ask(built, 0.01, present=0.01, measured=0.011)
    assert (built.state[:3] == start).all()


def test_a_nan_measurement_freezes_the_coefficients() -> None:
    built = compensators.build("ats", {}, DT)
    start = built.state[:3].copy()
    for k in range(1500):
        assert np.isfinite(ask(built, 0.01, measured=np.nan if k == 0 else 0.01 * (k % 50)))
    assert (built.state[:3] == start).all()


def test_the_same_input_gives_the_same_bits() -> None:
    runs = [drive("ats", {"lead": 0.02}, waves(BAND), 2000, noise=NOISE) for _ in range(2)]
    assert (runs[0].command == runs[1].command).all()
    assert (runs[0].coefficients == runs[1].coefficients).all()


def test_ats_starts_from_the_series_inverse_of_a_lag_for_its_lead() -> None:
    start = compensators.build("ats", {"lead": L, "time_constant": T}, DT).state[:3]
    assert start == pytest.approx(TRUE, rel=1e-12)


def test_impossible_starts_and_filters_are_refused() -> None:
    with pytest.raises(InputError, match="lead of compensator 'ats' is 0.05, but must be at most a1_most"):
        compensators.build("ats", {"lead": 0.05, "a1_most": 0.04}, DT)
    with pytest.raises(InputError, match="lead and time_constant of compensator 'ats' is 0.05, but"):
        compensators.build("ats", {"lead": 0.02, "time_constant": 0.03, "a1_most": 0.04}, DT)
    with pytest.raises(InputError, match="cutoff of compensator 'ats' is 250, but must be below 250 Hz"):
        compensators.build("ats", {"cutoff": 250.0}, DT)
