"""Whether a motion can be held, and over how many ticks: by the plan's limits alone."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from common.plan.plan import Plan
from common.plan.read import from_tables, load
from common.roles import MASTER
from laboratories import standstill
from laboratories.column.kind import COLUMN
from laboratories.device import Device
from laboratories.kind import Follows, Moving
from laboratories.kinds import kinds_of
from laboratories.table.kind import TABLE
from tests.helpers import ROOT

STILL = Moving(0.0, 0.0, (0.0, 0.0), (0.0, 0.0), 0.2)
TABLE_STILL = Moving(0.0, 0.0, (0.0,) * 4, (0.0,) * 4, 0.2)


def test_the_ramp_follows_from_the_fastest_target_and_the_ramp_to_rest(default_plan: Plan) -> None:
    # 1.5 times the table's 1.5 m/s over 10 m/s² are 0.225 s, 112.5 ticks
    assert standstill.ramp_ticks(default_plan) == 114
    gentle = replace(default_plan, safety=replace(default_plan.safety, acceleration=5.0))
    assert standstill.ramp_ticks(gentle) == 226
    stiff = replace(default_plan, safety=replace(default_plan.safety, acceleration=1e9, jerk=9.0))
    assert standstill.ramp_ticks(stiff) == 500  # the root of 6 · 1.5 / 9 in s
    endless = replace(default_plan, limits=replace(default_plan.limits, table_velocity=math.inf))
    assert standstill.fastest(TABLE, endless, "slave") == endless.limits.table_target_velocity
    assert standstill.fastest(COLUMN, endless, MASTER) == endless.limits.actuator_velocity


def test_a_plan_that_limits_no_speed_is_not_held() -> None:
    speeds = ("velocity", "actuator_velocity", "table_target_velocity", "table_velocity")
    plan = from_tables({"limits": dict.fromkeys(speeds, math.inf)}, Path())
    assert standstill.ramp_ticks(plan) == 0


def test_a_column_is_held_in_any_motion(default_plan: Plan) -> None:
    fast = STILL._replace(velocity=0.5, measured=(0.02, 2e5))
    found = standstill.judged(default_plan, {MASTER: fast, "slave": TABLE_STILL}, 1e-9)
    assert found == standstill.Judgement("", 0.0)


def test_what_a_dashpot_and_a_mass_between_floors_lose_is_judged_by_the_limit_of_errors() -> None:
    plan = from_tables({"column": {"damping": 1e4, "mass": 100.0}}, Path())
    moving = {MASTER: STILL._replace(velocity=0.05), "slave": TABLE_STILL}
    coupling = COLUMN.coupling(plan)
    rate = 0.05 / coupling.ratio
    energy = rate**2 * (coupling.damping * 0.2 + 0.5 * coupling.mass)
    assert standstill.judged(plan, moving, energy) == standstill.Judgement("", energy)
    refused = standstill.judged(plan, moving, 0.9 * energy)
    assert "error_energy in [limits] allows" in refused.obstacle


@pytest.mark.parametrize(
    ("stiffness", "damping", "peak"), [(64.0, 6.0, 0.5), (0.0, 8.0, 2.3), (0.0, 0.0, math.inf)]
)
def test_a_dampers_mass_swings_on_its_spring_or_coasts_to_its_dashpots_end(
    stiffness: float, damping: float, peak: float
) -> None:
    plan = from_tables(
        {"damper": {"mass": 16.0, "stiffness": stiffness, "damping": damping}, "control": {"amd": True}},
        Path(),
    )
    # 0.5 + 0.3 m/s, and 0.2 m/s by half of 32 N on 16 kg for 0.2 s
    moving = Moving(-0.3, 32.0, (0.0, 0.0, 0.3 if not stiffness else 0.0, 0.0), (0.0, 0.0, 0.5, 0.0), 0.2)
    assert TABLE.coasting(plan, moving).peak == pytest.approx(peak)


def test_a_users_device_on_a_floor_must_say_how_it_comes_to_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = load(ROOT / "examples" / "viscous_damper.toml")
    moving = {
        role: Moving(0.1, 0.0, (0.0,) * count, (0.0,) * count, 0.2)
        for role, kind in kinds_of(plan).items()
        if (count := len(kind.channels.names))
    }
    assert standstill.judged(plan, moving, math.inf).obstacle == ""
    device = next(kind for kind in kinds_of(plan).values() if isinstance(kind, Device))
    on_drift = device.coupling(plan.of("slave"))
    monkeypatch.setattr(
        type(device), "coupling", lambda _self, _plan: on_drift._replace(follows=Follows.FLOOR)
    )
    assert (
        "give the class of the kind a method `coasting`" in standstill.judged(plan, moving, math.inf).obstacle
    )
