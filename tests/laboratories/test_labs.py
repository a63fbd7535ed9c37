"""The emulated laboratories against independent solutions of their differential equations."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from common.plan.laboratory_tables import Actuator, Column, Damper, ShakingTable
from common.plan.plan import Plan
from laboratories.column import model as column_lab
from laboratories.sensors import noise
from laboratories.table import model as table_lab
from laboratories.table.kind import TABLE
from models.transfer_systems import delay

DT = 0.002
Array = NDArray[np.float64]


def commands(ticks: int, seed: int = 1) -> Array:
    """A smooth random command, m."""
    random = np.random.default_rng(seed)
    t = np.arange(ticks) * DT
    tones = random.uniform(0.5, 6.0, size=5), random.uniform(0.0, 6.0, size=5)
    return (
        0.003 * sum(np.sin(2.0 * np.pi * f * t + phase) for f, phase in zip(*tones, strict=True)) * np.tanh(t)
    )


def delayed_ramp(values: Array, lag: float) -> Any:
    """The command as the rig's controller ramps it, delayed: value written at tick k is reached at t_{k+1}."""
    times = DT * np.arange(values.size + 1)
    reached = np.concatenate([[0.0], values])
    return lambda t: np.interp(t - lag, times, reached)


@settings(max_examples=30, deadline=None)
@given(lag=st.floats(0.0, 0.02), share=st.floats(0.0, 1.0), substeps=st.integers(1, 8))
def test_the_delayed_command_equals_the_ramp_at_an_earlier_time(
    lag: float, share: float, substeps: int
) -> None:
    values = commands(60)
    segments = delay.split(DT, lag, substeps)
    history = np.zeros(segments.memory)
    borders = np.concatenate([[0.0], np.cumsum(segments.lengths)])
    exact = delayed_ramp(values, lag)
    assert borders[-1] == pytest.approx(DT)
    for tick, value in enumerate(values):
        delay.remember(history, value)
        for border, place in enumerate(borders):
            got = delay.delayed(history, segments.taps, border)
            assert got == pytest.approx(exact(tick * DT + place), abs=1e-12 + 1e-9 * abs(value))


@settings(max_examples=30, deadline=None)
@given(lag=st.floats(0.0, 0.02), substeps=st.integers(1, 8))
def test_a_held_command_is_delayed_in_steps(lag: float, substeps: int) -> None:
    values = commands(60)
    segments = delay.split(DT, lag, substeps, held=True)
    history = np.zeros(segments.memory)
    borders = np.concatenate([[0.0], np.cumsum(segments.lengths)])
    assert borders[-1] == pytest.approx(DT)
    for tick, value in enumerate(values):
        delay.remember(history, value)
        for place, (begin, end) in enumerate(pairwise(borders)):
            for share in (0.01, 0.99):
                source = math.floor(tick + (begin + share * (end - begin) - lag) / DT)
                expected = values[source] if source >= 0 else 0.0
                assert delay.delayed(history, segments.taps, place + 1) == expected


@pytest.mark.parametrize("lag", [0.0, 0.014, 0.0133])
def test_a_held_command_acts_on_the_lag_in_steps(lag: float) -> None:
    values, constant = commands(200), 0.010
    lab = column_lab.build(
        DT, Actuator(gain=0.98, delay=lag, time_constant=constant, command="held"), Column()
    )
    got = [column_lab.advance(lab, value)[0] for value in values]
    t = DT * np.arange(1, values.size + 1)
    exact = np.zeros(values.size)
    for tick, jump in enumerate(np.diff(values, prepend=0.0)):
        since = np.clip(t - tick * DT - lag, 0.0, None)
        exact -= 0.98 * jump * np.expm1(-since / constant)
    assert np.max(np.abs(got - exact)) < 1e-12


@pytest.mark.parametrize("lag", [0.0, 0.014, 0.0133, 0.0147])
@pytest.mark.parametrize("time_constant", [0.030, 0.004])
def test_the_actuator_solves_its_equation(lag: float, time_constant: float) -> None:
    values = commands(300)
    lab = column_lab.build(
        DT, Actuator(gain=0.98, delay=lag, time_constant=time_constant), Column(stiffness=1e7)
    )
    got = np.array([column_lab.advance(lab, value) for value in values])
    command = delayed_ramp(values, lag)
    times = DT * np.arange(1, values.size + 1)
    exact = solve_ivp(
        lambda t, y: (0.98 * command(t) - y) / time_constant,
        (0.0, times[-1]),
        [0.0],
        t_eval=times,
        max_step=DT / 8,
        rtol=1e-9,
        atol=1e-13,
    ).y[0]
    assert np.max(np.abs(got[:, 0] - exact)) < 1e-8
    assert np.array_equal(got[:, 1], 1e7 * got[:, 0])


def test_the_actuators_step_response_agrees_with_the_closed_form() -> None:
    lab = column_lab.build(DT, Actuator(gain=1.0, delay=0.014, time_constant=0.030), Column())
    for _ in range(200):
        displacement, _ = column_lab.advance(lab, 1.0)
    assert displacement == pytest.approx(1.0, abs=1e-5)
    lab = column_lab.build(DT, Actuator(gain=1.0, delay=0.014, time_constant=0.030), Column())
    got = [column_lab.advance(lab, 1.0)[0] for _ in range(30)]
    t = DT * np.arange(1, 31) - 0.014
    # the response to a ramp of one interval is the step response averaged over that interval
    late = np.clip(t, 0.0, None), np.clip(t - DT, 0.0, None)
    integral = [tau - 0.030 * (1.0 - np.exp(-tau / 0.030)) for tau in late]
    assert np.allclose(got, (integral[0] - integral[1]) / DT, atol=1e-12)


def test_an_ideal_actuator_reaches_its_command_at_the_intervals_end() -> None:
    lab = column_lab.build(DT, Actuator(gain=1.0, delay=0.0, time_constant=0.0), Column(stiffness=2.0))
    for value in (0.3, -0.1, 7.0):
        assert column_lab.advance(lab, value) == (value, 2.0 * value)


@pytest.mark.parametrize("lag", [0.0, 0.004, 0.0047])
@pytest.mark.parametrize("motor", [0.003, 0.0])
def test_table_and_damper_solve_their_equations(lag: float, motor: float) -> None:
    ticks = 400
    table, damper = (
        ShakingTable(frequency=15.0, damping_ratio=0.7, delay=lag),
        Damper(motor_time_constant=motor),
    )
    wanted, force = commands(ticks), 40.0 * commands(ticks, seed=2) / 0.003
    lab = table_lab.build(DT, table, damper)
    got = np.array([table_lab.advance(lab, u, f) for u, f in zip(wanted, force, strict=True)])
    command, omega = delayed_ramp(wanted, lag), 2.0 * math.pi * 15.0

    def acceleration(t: float, y: float, rate: float) -> float:
        return float(omega**2 * (command(t) - y) - 1.4 * omega * rate)

    def slope(t: float, z: Array, f: float) -> list[float]:
        y, rate, stroke, stroke_rate, u = z
        push = u if motor else f
        relative = (-damper.stiffness * stroke - damper.damping * stroke_rate + push) / damper.mass
        a = acceleration(t, y, rate)
        return [rate, a, stroke_rate, relative - a, (f - u) / motor if motor else 0.0]

    z, exact = np.zeros(5), []
    for tick, f in enumerate(force):
        span = (tick * DT, (tick + 1) * DT)
        z = solve_ivp(slope, span, z, args=(f,), max_step=DT / 4, rtol=1e-9, atol=1e-13).y[:, -1]
        push = z[4] if motor else f
        exact.append(
            (
                z[0],
                acceleration(span[1], z[0], z[1]),
                z[2],
                damper.stiffness * z[2] + damper.damping * z[3] - push,
            )
        )
    scale = np.max(np.abs(exact), axis=0)
    assert np.all(np.max(np.abs(got - exact), axis=0) < 2e-6 * scale)


def test_an_ideal_table_follows_at_once_and_moves_the_damper() -> None:
    table, damper = ShakingTable(frequency=math.inf, delay=0.0), Damper(stiffness=0.0, damping=0.0)
    wanted = commands(500)
    lab = table_lab.build(DT, table, damper)
    got = np.array([table_lab.advance(lab, u, 0.0) for u in wanted])
    assert np.allclose(got[:, 0], wanted, atol=1e-15)
    # a mass without spring and dashpot stays where it is in space
    assert np.allclose(got[:, 2], -wanted, atol=1e-12)
    padded = np.concatenate([[0.0, 0.0], wanted])
    assert np.allclose(got[:, 1], np.diff(padded, 2) / DT**2, atol=1e-6)


def test_the_dampers_force_balances_its_motion() -> None:
    lab = table_lab.build(DT, ShakingTable(), Damper())
    wanted = commands(1000)
    got = np.array([table_lab.advance(lab, u, 20.0 * u / 0.003) for u in wanted])
    absolute = np.diff(got[:, 0] + got[:, 2], 2) / DT**2
    # force on the table = −mass × absolute acceleration, to the accuracy of a second difference
    error = got[1:-1, 3] + 16.0 * absolute
    assert np.sqrt(np.mean(error**2)) < 0.02 * np.sqrt(np.mean(got[:, 3] ** 2))


def test_noise_drawn_tick_by_tick_equals_noise_drawn_at_once() -> None:
    levels = TABLE.noise(Plan())
    single, whole = noise.Noise(3, levels), noise.Noise(3, levels)
    rows = whole.rows(2500)
    assert np.array_equal(rows, [single.row() for _ in range(2500)])
    assert np.allclose(rows.std(axis=0), levels, rtol=0.05)
    assert noise.lab_seed(1, noise.LAB_A) != noise.lab_seed(1, noise.LAB_B)
