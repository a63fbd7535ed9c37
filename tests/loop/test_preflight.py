"""Risks that follow from the nominal models: margin of delay, peaks below the limits, several slaves."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from common.plan import read as plans
from common.plan.laboratory_tables import CompensatorTable, Control
from common.plan.plan import Plan
from common.roles import MASTER, SLAVE
from common.terminal import cli
from loop import substructure
from loop.closed_loop import simulate
from loop.nominal import limited, preflight
from loop.nominal.partition import assess, critical_delay_of
from loop.nominal.preflight import expected_delay, partition_check, peaks, simulated_peaks
from loop.signals import signals
from models.registry import Array
from tests.helpers import with_table


def uncompensated(plan: Plan) -> Plan:
    return dataclasses.replace(plan, compensator=CompensatorTable("none", {}))


@pytest.mark.parametrize("represents", [1, 2, 3, 4])
def test_the_critical_delay_of_a_storey_solves_its_characteristic_equation(
    default_plan: Plan, represents: int
) -> None:
    """`m·s² + c·s + k_n + k_e·e^(−s·τ) = 0` at `s = jω`, its modulus and its angle solved apart from the code."""
    plan = with_table(default_plan, "column", represents=represents)
    m, c, k = plan.structure.mass[0], plan.structure.damping[0], plan.structure.stiffness[0]
    k_n, k_e = k * (1.0 - represents / 4.0), k * represents / 4.0

    def excess(omega: float) -> float:
        return abs(complex(k_n - m * omega**2, c * omega)) - k_e

    middle = math.sqrt(max(k_n / m - 0.5 * (c / m) ** 2, 0.0))  # where the modulus is least
    delays = []
    for low, high in ((1e-6, middle), (middle, 10.0 * math.sqrt(k / m))):
        if excess(low) * excess(high) < 0.0:
            omega = brentq(excess, low, high, xtol=1e-12)
            turn = math.atan2(c * omega, -(k_n - m * omega**2))  # of −k_e·e^(−jωτ)
            delays.append(turn % (2.0 * math.pi) / omega)
    assert critical_delay_of(plan) == pytest.approx(min(delays), rel=1e-9)


def test_a_plan_with_less_than_the_required_delay_margin_is_refused(default_plan: Plan) -> None:
    found = assess(default_plan)
    expected = expected_delay(default_plan, found)
    assert expected == pytest.approx(0.0022, abs=1e-4)
    ratio = found.critical_delay / expected
    for factor, refused in ((0.999, False), (1.001, True)):
        plan = with_table(default_plan, "preflight", delay_margin=factor * ratio)
        assert (partition_check(plan, found).risk is not None) is refused
    early = found._replace(delay=-0.003)
    assert partition_check(default_plan, early).risk is None


def test_an_unstable_plan_is_refused_by_the_checks_of_partition_and_peaks(default_plan: Plan) -> None:
    plan = dataclasses.replace(uncompensated(default_plan), control=Control(amd=False))
    risks = [one.risk for one in preflight.checks(plan) if one.risk]
    assert [risk.name for risk in risks] == ["partition", "peaks"]
    assert "unstable beyond 32.9 ms of delay, and 44.7 ms are expected" in risks[0].sentence
    assert "column_error exceeds 90% of its limit of 0.01 m" in risks[1].sentence


@pytest.mark.parametrize("name", cli.SHIPPED)
def test_every_shipped_plan_passes_the_preflight_checks(name: str) -> None:
    made = preflight.checks(plans.load(cli.plan_path(name)))
    assert [one.risk for one in made] == [None, None]


def test_the_first_quantity_beyond_its_share_of_the_limit_is_named(short_plan: Plan) -> None:
    plan = with_table(short_plan, "limits", actuator_command=0.003, damper_stroke=0.01)
    found = simulated_peaks(plan)[2].risk
    assert found is not None
    columns = signals(
        plan, simulate(plan, substructure.ground_rows(plan, substructure.motion(plan)), seed=plan.test.seed)
    )
    tick = int(np.argmax(np.abs(columns["damper_stroke"]) > 0.009))
    assert tick < np.argmax(np.abs(columns["actuator_command"]) > 0.0027)
    peak = np.max(np.abs(columns["damper_stroke"]))
    assert f"the simulated damper_stroke exceeds 90% of its limit of 0.01 m at t = {tick * 0.002:.3f} s" in (
        found.sentence
    )
    assert f"peaks at {peak:.4g} m" in found.sentence
    assert "raise damper_stroke in [limits]" in found.sentence


def test_a_diverging_loop_is_called_unstable_without_advice_to_raise_a_limit(default_plan: Plan) -> None:
    wild = {"proportional": 60.0, "integral": 0.0, "derivative": 0.0}
    plan = dataclasses.replace(default_plan, compensator=CompensatorTable("pid", wild))
    first, second = (one.risk for one in preflight.checks(plan))
    assert first is not None
    assert "does not come to rest under compensator 'pid' (proportional = 60" in first.sentence
    assert second is not None
    assert second.name == "peaks"
    assert "the simulated loop is unstable" in second.sentence
    assert "raise" not in second.sentence


def test_a_long_delay_is_called_unstable_and_its_peaks_are_not_shown(default_plan: Plan) -> None:
    plan = with_table(default_plan, "actuator", delay=0.2)
    made = preflight.checks(plan)
    assert [one.risk.name for one in made if one.risk] == ["partition", "peaks"]
    told = " ".join([one.text for one in made] + [one.risk.sentence for one in made if one.risk])
    assert told.count("unstable") >= 4
    for word in ("points", "peaks at", "raise", "expected -", "inf"):
        assert word not in told
    assert "column_error exceeds 90% of its limit of 0.01 m at t = 1.492 s and keeps growing" in told


def test_a_lead_is_advised_only_where_it_removes_the_delay(default_plan: Plan) -> None:
    def advice(delay: float, lead: float) -> str:
        plan = with_table(default_plan, "actuator", delay=delay)
        plan = dataclasses.replace(plan, compensator=CompensatorTable("taylor", {"lead": lead, "order": 1.0}))
        risk = partition_check(plan, assess(plan)).risk
        return risk.sentence if risk else ""

    assert "raise lead in [compensator] from 10.0 ms to 42.8 ms" in advice(0.014, 0.01)
    assert "no lead in [compensator] removes the remaining 218.7 ms" in advice(0.2, 0.01)


def test_an_unstable_control_of_the_damper_is_named(default_plan: Plan) -> None:
    plan = with_table(default_plan, "control", gain=3e6)
    found = simulated_peaks(plan)[2].risk
    assert found is not None
    assert "lower gain in [control], 3e+06 N·s/m" in found.sentence


def test_limited_quantities_that_are_not_recorded_are_computed_from_the_signals(short_plan: Plan) -> None:
    n = 100
    t = np.linspace(0.0, (n - 1) * short_plan.test.interval, n)
    names = vars(short_plan.limits)
    still: dict[str, Array] = {name: np.zeros(n) for name in (*names, "column_target")}
    columns, slave = dict(still), dict(still)
    columns["actuator_command"] = np.square(t)
    slave["table_command"] = -0.3 * t
    columns["column_target"][[10, 11, 20, 21, 22]] = [1.0, 1.0, -1.0, 3.0, 2.0]
    found = limited.magnitudes(short_plan, {MASTER: columns, SLAVE: slave})
    assert set(found) == set(names) - set(limited.ENERGIES)
    assert np.allclose(found["actuator_acceleration"][2:], 2.0)
    assert found["actuator_velocity"][-1] == pytest.approx(2.0 * t[-1], rel=0.01)
    assert np.allclose(found["table_velocity"][1:], 0.3)
    assert np.allclose(found["table_step"][1:], 0.0006)
    assert np.flatnonzero(found["column_error"]).tolist() == [22]
    assert found["column_error"][22] == 1.0
    assert peaks(short_plan, {MASTER: columns, SLAVE: slave}).name == "column_error"


def test_the_peaks_of_several_slaves_are_checked() -> None:
    plan = plans.with_test(plans.load(cli.plan_path("two_dampers")), duration=3.0)
    assert "of their limits at most (" in simulated_peaks(plan)[2].text
    found = simulated_peaks(with_table(plan, "limits", damper_stroke=0.01))[2].risk
    assert found is not None
    assert "damper_stroke" in found.sentence
