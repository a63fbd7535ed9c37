"""The longest ramp to rest among the kinds that a plan hosts."""

from __future__ import annotations

from pathlib import Path

import pytest

from common.plan import read as plans
from common.plan.plan import Plan
from common.plan.read import parse
from common.terminal import cli
from laboratories.kinds import kind_of
from laboratories.longest import MARGIN_S, resting, way
from tests.helpers import ROOT, with_table

HERE = Path()
DEVICE = ROOT / "examples" / "viscous_damper.toml"
UNLOADING = 0.05 / 0.01  # s: the largest command of the actuator at the ramp's speed
HALT = 0.05  # m: way to a halt from 1 m/s at 10 m/s²


@pytest.mark.parametrize("name", ["default", "single_site", "two_columns", "two_slaves"])
def test_a_plan_with_a_column_takes_the_ramp_from_the_columns_largest_command(name: str) -> None:
    plan = plans.load(cli.plan_path(name))
    assert UNLOADING < resting(plan) - MARGIN_S < UNLOADING + 2.0


def test_plans_with_tables_only_come_to_rest_soon() -> None:
    tables = parse('[master]\nkind = "none"\n', HERE)
    assert resting(tables) < MARGIN_S + 1.0
    slow = with_table(tables, "safety", release=8.0)
    assert 8.0 < resting(slow) - MARGIN_S < 9.0


def test_the_longest_ramp_is_bounded_without_a_limit_on_speed() -> None:
    assert resting(parse("", HERE)) == resting(Plan())
    free = parse("[limits]\nactuator_velocity = inf\nactuator_step = inf", HERE)
    assert resting(free) == resting(Plan())


def test_no_ramp_within_the_limits_takes_longer() -> None:
    plan = Plan()
    column = kind_of(plan, "master")
    longest = way(column, plan)
    for place in (0.01, 0.03, 0.05):
        for speed in (-0.5, 0.0, 0.5):
            ramp = column.ramp(plan, (place,), (place - speed * plan.test.interval,))
            seconds = 0.0
            while not ramp.done:
                ramp.step((place, 1e5))  # the load stays until the command is at zero
                seconds += plan.test.interval
            assert seconds <= longest


def test_a_devices_longest_ramp_follows_from_its_own_limits() -> None:
    plan = plans.load(DEVICE)
    assert 0.1 < 0.01 * (resting(plan) - MARGIN_S) < 0.1 + 2.0 * HALT  # its largest command is 0.1 m
    far = with_table(plan, "device", limits={"piston_command": 0.3})
    assert 0.3 < 0.01 * (resting(far) - MARGIN_S) < 0.3 + 2.0 * HALT


def test_the_ramp_of_a_device_without_limits_is_bounded_by_the_buildings_displacement_limit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plan = plans.load(DEVICE)
    monkeypatch.setattr(type(kind_of(plan, "slave")), "most", {})
    far = 2.0 * plan.limits.displacement
    assert far < 0.01 * (resting(plan) - MARGIN_S) < far + 8.0 * HALT  # from twice the speed


def test_a_ramp_of_a_users_kind_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    class Slow:
        left = 90.0

    plan = plans.load(DEVICE)
    monkeypatch.setattr(type(kind_of(plan, "slave")), "ramp", lambda *_: Slow())
    assert resting(plan) == pytest.approx(90.0 + plan.safety.settle + MARGIN_S)
