"""The laws of `column.viscous` beyond the one with the rate, against closed forms and another solver."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from common.plan.laboratory_tables import Column
from common.plan.plan import Plan
from loop import replay
from models.system import ColumnEffects, Effects, System
from tests.laboratories.effects.histories import SHORT, Array, K, cycles, specimen_under


def test_a_viscous_column_may_depend_on_a_power_of_the_rate() -> None:
    _, path = cycles(2e-3, 1.0)
    speed = np.diff(path, prepend=path[0]) / SHORT
    more = ColumnEffects(viscous=4e4, viscous_law=1.0, viscous_exponent=0.4)
    expected = K * path + 4e4 * 0.1 * np.sign(speed) * (np.abs(speed) / 0.1) ** 0.4
    assert np.allclose(specimen_under(path, more), expected, rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("exponent", [0.3, 1.0, 1.6])
def test_a_dashpot_behind_a_spring_solves_maxwells_equation(exponent: float) -> None:
    _, path = cycles(2e-3, 1.0, 1)
    more = ColumnEffects(viscous=4e5, viscous_law=2.0, viscous_exponent=exponent, viscous_stiffness=2e7)

    def rate(t: float, f: Array) -> Array:
        size = 0.1 * (np.abs(f) / (4e5 * 0.1)) ** (1.0 / exponent)
        return np.asarray(2e7 * (2e-3 * 2.0 * np.pi * np.cos(2.0 * np.pi * t) - np.sign(f) * size))

    times = np.arange(path.size) * SHORT
    exact = solve_ivp(rate, (0.0, times[-1]), [0.0], t_eval=times, method="LSODA", rtol=1e-8, atol=1e-2).y[0]
    got = specimen_under(path, more)
    assert np.max(np.abs(got - exact)) < 0.02 * np.max(np.abs(exact))


def test_a_dashpot_behind_a_spring_beside_the_specimen_solves_maxwells_equation() -> None:
    _, path = cycles(2e-3, 1.0, 1)
    stiffness, relaxation, h, f = 3e6, 0.03, SHORT, 0.0
    exact = [0.0]
    for moved in np.diff(path):  # exact for a constant rate
        fade = math.exp(-h / relaxation)
        f = fade * f + stiffness * moved * relaxation / h * (1.0 - fade)
        exact.append(f)
    more = ColumnEffects(viscous=stiffness * relaxation, viscous_law=3.0, viscous_stiffness=stiffness)
    got = specimen_under(path, more) - K * path
    assert np.max(np.abs(got - np.array(exact))) < 0.02 * np.max(np.abs(exact))


def test_a_power_of_the_rate_may_stand_in_the_place_of_the_planned_dashpot() -> None:
    _, path = cycles(2e-3, 1.0)
    planned = Column(stiffness=K, damping=7e4)
    more = ColumnEffects(viscous=4e4, viscous_law=4.0, viscous_exponent=0.4)
    alone = replace(more, viscous_law=1.0)
    assert np.array_equal(
        specimen_under(path, more, column=planned),
        specimen_under(path, alone, column=replace(planned, damping=0.0)),
    )


@pytest.mark.parametrize("law", [0.0, 1.0, 4.0])
def test_a_column_replayed_from_its_motion_has_the_rate_of_each_tick(law: float) -> None:
    plan = Plan()
    plan = replace(plan, column=replace(plan.column, stiffness=K, damping=7e4))
    interval, omega = plan.test.interval, 2.0 * math.pi
    t = interval * np.arange(1000)
    more = ColumnEffects(viscous=4e4, viscous_law=law, viscous_exponent=0.4 if law else 1.0)
    got = replay.column(System(plan, Effects(column=more)), 5e-3 * np.sin(omega * t))
    rate = 5e-3 * omega * np.cos(omega * t)
    expected = 4e4 * 0.1 * np.sign(rate) * (np.abs(rate) / 0.1) ** more.viscous_exponent
    expected += K * 5e-3 * np.sin(omega * t) + (0.0 if law == 4.0 else 7e4) * rate
    steady = np.abs(rate) > 5e-4  # a power below 1 bends where the motion turns
    assert np.allclose(got[1:-1][steady[1:-1]], expected[1:-1][steady[1:-1]], rtol=1e-3, atol=2.0)
