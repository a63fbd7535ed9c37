"""The sensors' effects against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import signal
from scipy.integrate import solve_ivp

from common.plan.plan import Plan
from common.plan.read import with_test
from common.plan.tables import SensorsTable
from common.rig import ColumnCommand, TableCommand
from laboratories.column.kind import COLUMN
from laboratories.effects import CATALOGUE, lay
from laboratories.emulated import EmulatedLab
from laboratories.sensors import readings
from laboratories.table.kind import TABLE
from loop import substructure
from loop.closed_loop import Rollout, simulate
from models.system import Effects, SensorEffects, System

Array = NDArray[np.floating[Any]]

DT = 0.002
NAME = "column_force"
WIDE = st.floats(-1e6, 1e6, allow_subnormal=False)


def read(values: Array, effects: SensorEffects, noises: Array | None = None, interval: float = DT) -> Array:
    """The readings of a channel that has these values at the ticks."""
    sensors = readings.build(interval, (NAME,), {NAME: effects})
    added = np.zeros(values.size) if noises is None else noises
    pairs = zip(values.tolist(), added.tolist(), strict=True)
    return np.array([readings.step(sensors, 0, v, n, k * interval) for k, (v, n) in enumerate(pairs)])


@given(st.lists(st.tuples(WIDE, WIDE), min_size=1, max_size=20))
def test_without_effects_a_reading_is_value_plus_noise_to_the_last_bit(
    rows: list[tuple[float, float]],
) -> None:
    values, noises = np.array(rows).T
    assert read(values, SensorEffects(), noises).tobytes() == (values + noises).tobytes()


@given(
    gain=st.floats(0.0, 5.0),
    bias=st.floats(-1e5, 1e5),
    drift=st.floats(-1e4, 1e4),
    values=st.lists(WIDE, min_size=1, max_size=20),
)
def test_gain_bias_and_drift_give_a_straight_line(
    gain: float, bias: float, drift: float, values: list[float]
) -> None:
    given_, noises = np.array(values), np.arange(len(values)) * 0.3
    got = read(given_, SensorEffects(gain=gain, bias=bias, drift=drift), noises)
    t = np.arange(given_.size) * DT
    assert np.allclose(got, gain * given_ + bias + drift * t + noises, rtol=1e-12, atol=1e-6)


@given(tau=st.floats(1e-4, 0.5), damping=st.sampled_from([math.inf, 0.75, 1.0, 1.9]))
@settings(max_examples=30)
def test_the_steady_lag_behind_a_ramp_is_the_time_constant(tau: float, damping: float) -> None:
    ticks = math.ceil(25.0 * tau / DT) + 5
    ramp = 3.0 * DT * np.arange(ticks)
    got = read(ramp, SensorEffects(lag=tau, lag_damping=damping))
    assert ramp[-1] - got[-1] == pytest.approx(3.0 * tau, rel=1e-6)


@given(tau=st.floats(1e-4, 0.5))
@settings(max_examples=30)
def test_the_response_to_a_ramped_step_agrees_with_the_closed_form(tau: float) -> None:
    """The value ramps from 0 at tick 0 to 1 at tick 1 and stays."""
    got = read(np.concatenate([[0.0], np.ones(100)]), SensorEffects(lag=tau))
    t = DT * np.arange(1, 101)
    early, late = (x - tau * (-np.expm1(-x / tau)) for x in (t, t - DT))
    assert got[0] == 0.0
    assert np.allclose(got[1:], (early - late) / DT, atol=1e-10)


def test_a_sensors_lag_of_second_order_solves_its_equation() -> None:
    t = DT * np.arange(300)
    values = np.sin(17.0 * t) + 0.2 * np.sin(90.0 * t)
    effect = (f"sensor.{NAME}.lag", {"time_constant": 0.012, "law": 1.0, "damping": 0.6})
    late = lay(System(Plan()), [effect]).effects.sensors[NAME]
    omega = 2.0 * 0.6 / 0.012
    exact = signal.lsim(([omega**2], [1.0, 1.2 * omega, omega**2]), values, t)[1]
    assert np.allclose(read(values, late), exact, atol=1e-9)


def test_a_sensors_lag_solves_its_equation_before_gain_and_bias_apply() -> None:
    t = DT * np.arange(200)
    values = np.sin(17.0 * t) + 0.2 * np.sin(90.0 * t)
    got = read(values, SensorEffects(gain=1.1, bias=0.3, lag=0.008))
    exact = solve_ivp(
        lambda x, y: (np.interp(x, t, values) - y) / 0.008,
        (0.0, t[-1]),
        [0.0],
        t_eval=t,
        max_step=DT / 4,
        rtol=1e-9,
        atol=1e-12,
    ).y[0]
    assert np.allclose(got, 1.1 * exact + 0.3, atol=1e-7)


@given(tau=st.floats(0.05, 100.0))
@settings(max_examples=30)
def test_a_high_pass_forgets_a_ramped_step_by_the_closed_form(tau: float) -> None:
    """The value ramps from 0 at tick 0 to 1 at tick 1 and stays."""
    got = read(np.concatenate([[0.0], np.ones(100)]), SensorEffects(high_pass=tau))
    passed = -tau / DT * math.expm1(-DT / tau)
    assert got[0] == 0.0
    assert np.allclose(got[1:], passed * np.exp(-DT / tau * np.arange(100)), rtol=1e-12, atol=1e-12)


def test_a_high_pass_halves_the_power_at_its_corner_and_is_early_there() -> None:
    tau = 2.0
    t = DT * np.arange(20000)
    got = read(np.sin(t / tau), SensorEffects(high_pass=tau))[10000:]
    assert got == pytest.approx(np.sin(t / tau + np.pi / 4.0)[10000:] / np.sqrt(2.0), abs=2e-3)


@given(delay=st.floats(1e-5, 0.2), start=st.floats(-5.0, 5.0), interval=st.sampled_from([DT, 1.0 / 4096.0]))
@settings(max_examples=60)
def test_a_delayed_reading_is_interpolated_linearly_between_earlier_values(
    delay: float, start: float, interval: float
) -> None:
    values = start + np.random.default_rng(8).normal(size=round(0.25 / interval))
    t = interval * np.arange(values.size)
    got = read(values, SensorEffects(delay=delay), interval=interval)
    known = t >= delay
    assert np.allclose(got[known], np.interp(t[known] - delay, t, values), atol=1e-9)
    assert (got[t < delay - interval] == 0.0).all()


def test_gain_bias_drift_and_noise_apply_after_lag_and_delay() -> None:
    values, noises = np.sin(0.1 * np.arange(80.0)), np.cos(3.0 * np.arange(80.0))
    lagged = read(values, SensorEffects(lag=0.008))
    more = SensorEffects(gain=1.1, bias=0.3, drift=2.0, lag=0.008, delay=3 * DT)
    expected = 1.1 * np.concatenate([np.zeros(3), lagged[:-3]]) + 0.3 + 2.0 * DT * np.arange(80) + noises
    assert np.allclose(read(values, more, noises), expected, atol=1e-12)


def test_each_reading_has_its_own_delay() -> None:
    names = ("column_displacement", "column_force")
    delays = {"column_displacement": SensorEffects(delay=2 * DT), "column_force": SensorEffects(delay=5 * DT)}
    sensors = readings.build(DT, names, delays)
    rows = np.array(
        [[readings.step(sensors, i, float(k + 1), 0.0, k * DT) for i in range(2)] for k in range(12)]
    )
    ramp = np.arange(12.0)
    assert np.allclose(rows.T, [np.maximum(ramp - 1.0, 0.0), np.maximum(ramp - 4.0, 0.0)])


def test_a_sensors_lag_does_not_affect_its_noise() -> None:
    values, noises = np.sin(np.arange(50.0)), np.cos(3.0 * np.arange(50.0))
    more = SensorEffects(gain=0.9, lag=0.02)
    assert np.allclose(read(values, more, noises) - read(values, more), noises, atol=1e-12)


@given(step=st.floats(1e-3, 1e3), values=st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=30))
def test_a_quantised_reading_lies_on_the_grid_within_half_a_step(step: float, values: list[float]) -> None:
    noises = 0.37 * np.arange(len(values))
    got = read(np.array(values), SensorEffects(quantization=step), noises)
    assert np.max(np.abs(got - np.array(values) - noises)) <= 0.5 * step * (1.0 + 1e-9) + 1e-9
    assert np.allclose(got / step, np.round(got / step), rtol=1e-12, atol=1e-9)


def test_quantisation_errors_agree_with_widrows_model() -> None:
    """Of a signal that moves over many steps they are uniform: rms step/√12, and no bias."""
    values = np.random.default_rng(4).normal(size=20_000) * 50.0
    error = read(values, SensorEffects(quantization=2.0)) - values
    assert error.std() == pytest.approx(2.0 / math.sqrt(12.0), rel=0.02)
    assert abs(error.mean()) < 4.0 * error.std() / math.sqrt(values.size)


@pytest.mark.parametrize("sharpness", [1.0, 2.0, 20.0])
def test_a_saturating_reading_keeps_small_values_and_bends_towards_its_limit(sharpness: float) -> None:
    values = np.array([-1e9, -30.0, -1e-6, 0.0, 1e-6, 30.0, 1e9])
    got = read(values, SensorEffects(saturation=30.0, saturation_sharpness=sharpness, bias=5.0)) - 5.0
    half = 30.0 / 2.0 ** (1.0 / sharpness)
    assert got == pytest.approx([-30.0, -half, -1e-6, 0.0, 1e-6, half, 30.0], rel=1e-5, abs=1e-12)


@pytest.mark.parametrize("name", [*COLUMN.channels.names, *TABLE.channels.names])
def test_noise_levels_add_as_independent_noises(name: str) -> None:
    kind = COLUMN if name in COLUMN.channels.names else TABLE
    names, nominal = kind.channels.names, kind.noise(Plan())
    found = readings.levels(names, nominal, {name: SensorEffects(noise=3.0)})
    for place, other in enumerate(names):
        squared = nominal[place] ** 2 + (9.0 if other == name else 0.0)
        assert found[place] == pytest.approx(math.sqrt(squared))
    assert readings.levels(names, nominal, {}).tobytes() == nominal.tobytes()


def test_the_noise_of_a_reading_combines_the_nominal_level_and_the_effects() -> None:
    force = SensorEffects(noise=300.0)
    loud = Plan(sensors=SensorsTable(column_force=400.0))
    lab = EmulatedLab(COLUMN, System(loud, Effects(sensors={"column_force": force})), 3)
    got = np.array([lab.read() for _ in range(8000)])
    assert got[:, 1].std() == pytest.approx(500.0, rel=0.03)
    assert got[:, 0].std() == pytest.approx(5e-6, rel=0.03)
    table = SensorEffects(noise=3e-5)
    other = EmulatedLab(TABLE, System(Plan(), Effects(sensors={"table_displacement": table})), 3)
    rows = np.array([other.read() for _ in range(8000)])
    assert rows[:, 0].std() == pytest.approx(math.hypot(10e-6, 3e-5), rel=0.03)
    assert rows[:, 3].std() == pytest.approx(0.2, rel=0.03)


SIZES = {"gain": 1.1, "bias": 0.02, "drift": 0.01, "lag": 0.005, "delay": 0.0071}


@pytest.mark.parametrize("kind", SIZES)
@pytest.mark.parametrize("name", [*COLUMN.channels.names, *TABLE.channels.names])
def test_a_falsified_reading_leaves_the_true_values_unchanged(name: str, kind: str) -> None:
    """From one laboratory's readings without the effect, those with it by the formula."""
    effect = CATALOGUE[f"sensor.{name}.{kind}"]
    size = SIZES[kind] * (1.0 if kind in ("gain", "lag", "delay") else min(effect.parameters[0].most, 1.0))
    system = lay(System(Plan()), [(effect.name, {effect.parameters[0].name: size})])
    quiet = Plan(sensors=SensorsTable(**dict.fromkeys((*COLUMN.channels.names, *TABLE.channels.names), 0.0)))
    rows: list[list[tuple[float, ...]]] = []
    for effects in (Effects(), system.effects):
        lab_a, lab_b = (EmulatedLab(kind, System(quiet, effects), 1) for kind in (COLUMN, TABLE))
        rows.append([])
        for tick in range(300):
            rows[-1].append((*lab_a.read(), *lab_b.read()))
            lab_a.write(ColumnCommand(2e-3 * math.sin(0.03 * tick)))
            lab_b.write(TableCommand(1e-2 * math.sin(0.02 * tick), 30.0 * math.sin(0.04 * tick)))
    plain, falsified = np.array(rows[0]), np.array(rows[1])
    place = (*COLUMN.channels.names, *TABLE.channels.names).index(name)
    t, value = DT * np.arange(300), plain[:, place]
    expected = {
        "gain": size * value,
        "bias": value + size,
        "drift": value + size * t,
        "lag": read(value, SensorEffects(lag=size)),
        "delay": np.interp(t - size, t, value, left=0.0),
    }[kind]
    assert np.allclose(falsified[:, place], expected, rtol=1e-12, atol=1e-12)
    others = np.delete(np.arange(6), place)
    assert np.array_equal(falsified[:, others], plain[:, others])


def loop(system: System) -> Rollout:
    ground = substructure.ground_rows(system.plan, substructure.motion(system.plan))
    return simulate(system.plan, ground, effects=system.effects)


def test_the_loop_acts_on_the_falsified_force(default_plan: Plan) -> None:
    """In a linear laboratory a load cell with a gain acts like a specimen with that factor on its stiffness."""
    plan = with_test(default_plan, duration=3.0)
    cell = loop(lay(System(plan), [("sensor.column_force.gain", {"factor": 1.07})]))
    column = loop(lay(System(plan), [("column.stiffness", {"factor": 1.07})]))
    for name, right in column.master.items():
        assert np.allclose(cell.master[name], right, rtol=1e-9, atol=1e-9 * np.max(np.abs(right)))
    nominal = loop(System(plan))
    displacement = cell.master["displacement"] - nominal.master["displacement"]
    assert np.max(np.abs(displacement)) > 1e-4


def test_a_bias_of_the_force_deflects_the_building_as_in_statics(default_plan: Plan) -> None:
    plan = with_test(default_plan, duration=20.0)
    still = np.zeros((2, plan.ticks + 1))
    system = lay(System(plan), [("sensor.column_force.bias", {"offset": 1000.0})])
    found = simulate(system.plan, still, effects=system.effects)
    # 3/4 of the storey and the specimen hold against the force that is not there
    stiffness = 0.75 * 25e6 + 12.5e6 * 0.5
    x = found.master["displacement"]
    assert x[-1] == pytest.approx(-1000.0 / stiffness, rel=2e-3)
    assert found.master["column_force"][-1] == pytest.approx(1000.0 + 12.5e6 * 0.5 * x[-1], rel=2e-3)
