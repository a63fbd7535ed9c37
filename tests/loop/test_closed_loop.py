"""The closed loop, compared with the specified figures and with the theory of delayed feedback."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from common.plan.laboratory_tables import Actuator, CompensatorTable, Control
from common.plan.plan import Plan, ideal
from common.plan.read import from_tables, with_test
from common.roles import SLAVE
from common.signals import TOPICS
from laboratories.column.kind import COLUMN
from loop import substructure
from loop.closed_loop import MessagesUsed, on_time, simulate
from loop.signals import rows, signals
from models.structures import shear_building
from tests.helpers import largest, with_table


def ground(plan: Plan) -> np.ndarray:
    return substructure.ground_rows(plan, substructure.motion(plan))


def without_damper(plan: Plan) -> Plan:
    return dataclasses.replace(plan, control=Control(amd=False))


def test_the_default_test_has_the_specified_period_and_damping() -> None:
    plan = Plan()
    values = (
        np.array(table) for table in (plan.structure.mass, plan.structure.stiffness, plan.structure.damping)
    )
    found = shear_building.modes(*shear_building.matrices(*values))
    assert found.periods[0] == pytest.approx(0.5027, abs=1e-4)
    assert found.damping_ratios[0] == pytest.approx(0.05, abs=1e-3)


def test_the_default_test_has_the_specified_peaks(default_plan: Plan) -> None:
    found = signals(default_plan, simulate(default_plan, ground(default_plan)))
    assert largest(found["displacement"]) == pytest.approx(4.8e-3, rel=0.03)
    assert largest(found["damper_stroke"]) == pytest.approx(49e-3, rel=0.03)
    assert largest(found["damper_force"]) == pytest.approx(76.0, rel=0.03)


def test_the_nominal_building_drifts_by_the_published_peak(default_plan: Plan) -> None:
    plan = without_damper(ideal(default_plan))
    found = signals(plan, simulate(plan, ground(plan)))
    assert largest(found["displacement"]) == pytest.approx(5.8e-3, rel=0.02)


def growth(plan: Plan, delay: float, seconds: float = 30.0) -> float:
    """Growth rate (1/s) of the loop's free vibration behind a pure delay of the actuator, after a shock."""
    plan = dataclasses.replace(
        with_test(without_damper(plan), duration=seconds),
        actuator=Actuator(gain=1.0, delay=delay, time_constant=0.0),
        compensator=CompensatorTable("none", {}),
    )
    shock = np.zeros((2, plan.ticks + 1))
    shock[0, 1:6] = 1.0
    x = signals(plan, simulate(plan, shock))["displacement"]
    half = x.size // 2
    early, late = largest(x[half // 2 : half]), largest(x[-half // 2 :])
    return math.log(late / early) / (0.75 * seconds * 2 / 3)


def test_the_critical_delay_solves_the_characteristic_equation(default_plan: Plan) -> None:
    # (Mω² − (K − k))² + (Cω)² = k², k a quarter of the storey: 32.9 ms; the wait of a ramp and the
    # integrator's own tick are part of the loop's delay
    low, high = 0.025, 0.040
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if growth(default_plan, middle) < 0.0 else (low, middle)
    assert low == pytest.approx(0.0329, abs=0.0005)


@pytest.mark.parametrize(("delay", "damping"), [(0.004, 0.0437), (0.012, 0.0313), (0.016, 0.0251)])
def test_each_millisecond_of_delay_costs_the_damping_of_theory(
    default_plan: Plan, delay: float, damping: float
) -> None:
    rate = growth(default_plan, delay, seconds=8.0)
    omega = math.sqrt(25e6 / 160e3)
    assert -rate / omega == pytest.approx(damping, abs=0.0015)


def test_the_uncompensated_test_diverges(default_plan: Plan) -> None:
    plan = without_damper(dataclasses.replace(default_plan, compensator=CompensatorTable("none", {})))
    found = signals(plan, simulate(plan, ground(plan)))
    assert largest(found["column_displacement"]) > plan.limits.column_displacement
    assert largest(found["displacement"][-2000:]) > largest(found["displacement"][8000:10000]) * 2.0


def test_a_rollout_that_diverges_to_infinity_is_cut_at_the_last_finite_tick(default_plan: Plan) -> None:
    plan = dataclasses.replace(
        with_table(default_plan, "actuator", gain=200.0), compensator=CompensatorTable("none", {})
    )
    rollout = simulate(plan, ground(plan))
    assert not rollout.finite
    assert 0 < rollout.ticks < plan.ticks
    assert all(np.all(np.isfinite(values)) for values in signals(plan, rollout).values())


def test_the_damper_adds_three_points_of_damping(default_plan: Plan) -> None:
    def decay(plan: Plan) -> float:
        plan = ideal(with_test(plan, duration=6.0))
        shock = np.zeros((2, plan.ticks + 1))
        shock[0, 1:6] = 1.0
        x = np.abs(signals(plan, simulate(plan, shock))["displacement"])
        peaks = [place for place in range(1, x.size - 1) if x[place - 1] < x[place] >= x[place + 1]]
        first, last = peaks[2], peaks[8]
        return math.log(x[first] / x[last]) / (math.pi * 6)

    assert decay(default_plan) - decay(without_damper(default_plan)) == pytest.approx(0.030, abs=0.002)


def test_noise_depends_on_the_seed_only(short_plan: Plan) -> None:
    rows_ = ground(short_plan)
    first, again, other = (simulate(short_plan, rows_, seed=seed) for seed in (1, 1, 2))
    for name in COLUMN.channels.names:
        assert np.array_equal(first.master[name], again.master[name])
        assert not np.array_equal(first.master[name], other.master[name])


def test_the_previous_message_stands_in_for_a_lost_one(short_plan: Plan) -> None:
    nominal = on_time(short_plan.ticks)
    command, feedback = nominal.command.copy(), nominal.feedback.copy()
    command[500], feedback[700] = 499, 698
    exchange = {SLAVE: MessagesUsed(command, feedback)}
    found = signals(short_plan, simulate(short_plan, ground(short_plan), exchange=exchange))
    assert found["damper_force_used"][700] == found["damper_force"][698]
    assert found["damper_force_used"][701] == found["damper_force"][700]


@pytest.mark.parametrize("integrator", ["newmark_explicit", "central_difference", "cr", "kr_alpha"])
def test_every_integrator_gives_the_same_peak_displacement(default_plan: Plan, integrator: str) -> None:
    plan = with_table(default_plan, "structure", integrator=integrator, rho_infinity=1.0)
    found = signals(plan, simulate(plan, ground(plan)))
    assert largest(found["displacement"]) == pytest.approx(4.87e-3, rel=0.02)


def test_specimen_and_damper_act_at_the_planned_storey_and_floor(default_plan: Plan) -> None:
    plan = with_table(
        default_plan, "structure", mass=[1.6e5] * 3, stiffness=[9e7, 8e7, 6e7], damping=[4e5, 4e5, 3e5]
    )
    plan = with_table(with_table(plan, "column", storey=2, stiffness=40e6), "damper", floor=3)
    found = signals(plan, simulate(plan, ground(plan)))
    x = found["displacement"]
    assert x.shape == (plan.ticks, 3)
    drift = x[:, 1] - x[:, 0]
    assert np.allclose(found["column_target"], 0.5 * drift, atol=1e-15)
    assert np.allclose(found["numerical_force"][:, 0], 9e7 * x[:, 0])
    assert np.allclose(found["numerical_force"][:, 1], 0.75 * 8e7 * drift)
    still = with_table(plan, "control", amd=False)
    assert largest(signals(still, simulate(still, ground(still)))["displacement"][:, 2]) > largest(x[:, 2])


def test_numerical_columns_may_yield(default_plan: Plan) -> None:
    tables = default_plan.tables()
    tables["structure"]["columns"] = {"model": "bilinear", "yield_displacement": 0.002, "hardening": 0.1}
    yielding = from_tables(tables, default_plan.base)
    found = signals(yielding, simulate(yielding, ground(yielding)))
    limit = 18.75e6 * (0.002 + 0.1 * (largest(found["displacement"]) - 0.002))
    assert largest(found["numerical_force"]) == pytest.approx(limit, rel=1e-6)


def test_the_rows_of_a_recording_equal_the_signals_of_the_rollout(short_plan: Plan) -> None:
    rollout = simulate(short_plan, ground(short_plan), seed=1)
    found, written = signals(short_plan, rollout), list(rows(short_plan, rollout))
    assert len(written) == 2 * short_plan.ticks
    topic, values = written[2 * 800]
    named = dict(zip([row.name for row in TOPICS[topic]], values, strict=True))
    assert topic == "master"
    assert named["column_force"] == found["column_force"][800]
    assert named["damper_force_seq"] == 799
