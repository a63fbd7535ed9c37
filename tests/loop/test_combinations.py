"""Combinations of laboratories share compiled code, because the types in their loops are the same."""

from __future__ import annotations

from pathlib import Path

import numba
import pytest

from common.plan import read as plans
from common.plan.plan import Plan
from common.roles import MASTER
from common.terminal import cli
from loop import closed_loop, substructure
from loop.closed_loop import ClosedLoop, on_time
from models.system import System
from tests.helpers import ROOT

DEVICE = ROOT / "examples" / "viscous_damper.toml"
NONE = '[master]\nkind = "none"\n'


def loop_of(plan: Plan) -> ClosedLoop:
    """The closed loop of a plan over a few ticks, before its first one."""
    plan = plans.with_test(plan, duration=0.02)
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    systems = {role: System(plan.of(role)) for role in plan.roles}
    drawn = closed_loop.errors({MASTER: System(plan)} | systems, None, {})
    exchange = {role: on_time(plan.ticks) for role in plan.roles}
    return closed_loop.at_rest(System(plan), systems, ground, exchange, drawn)


def types(loop: ClosedLoop) -> str:
    """The types for which code of a loop is compiled."""
    return str(numba.typeof(loop))  # type: ignore[no-untyped-call]


def plan_of(text: str) -> Plan:
    return plans.parse(text, Path())


@pytest.mark.parametrize("name", ["two_storeys", "two_slaves", "device", "table alone", "table, column"])
def test_a_new_combination_of_kinds_needs_no_new_compiled_loop(name: str) -> None:
    plan = {
        "device": lambda: plans.load(DEVICE),
        "table alone": lambda: plan_of('[master]\nkind = "table"\n[slave]\nkind = "none"\n'),
        "table, column": lambda: plan_of('[master]\nkind = "table"\n[slave]\nkind = "column"\n'),
    }.get(name, lambda: plans.load(cli.plan_path(name)))()
    known = loop_of(plans.load(cli.plan_path("two_columns")))
    assert types(loop_of(plan)) == types(known)


def test_a_master_without_slaves_uses_the_default_tests_compiled_loop() -> None:
    alone = loop_of(plans.load(cli.plan_path("single_site")))
    assert types(alone) == types(loop_of(Plan()))
    assert alone.traffic.used.shape[1] == 0


def test_three_and_four_slaves_share_a_compiled_loop() -> None:
    three, four = (
        plan_of(NONE + "".join(f'[slave.{name}]\nkind = "column"\n[slave.{name}.column]\n' for name in names))
        for names in ("abc", "abcd")
    )
    assert types(loop_of(three)) == types(loop_of(four))


def test_the_length_of_a_test_changes_no_type() -> None:
    for duration in (0.02, 60.0):  # shorter and longer than the record
        plan = plans.with_test(Plan(), duration=duration)
        rows = substructure.ground_rows(plan, substructure.motion(plan))
        assert rows.flags.c_contiguous, duration
