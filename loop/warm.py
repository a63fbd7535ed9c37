"""`python -m loop.warm`: compile every kernel once, so that no test has to wait for it."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from common.plan.plan import Plan
from common.plan.read import with_test
from laboratories.column import model as column_lab
from laboratories.kinds import KINDS
from laboratories.sensors import readings
from laboratories.table import model as table_lab
from loop import replay, substructure
from loop.closed_loop import simulate
from loop.nominal.response import response
from models import cache, compensators, energy_balance
from models.compiled import plain
from models.system import System


def compile_all() -> None:
    """Compile what the loops and the simulation call, and note that it is done."""
    plan = with_test(Plan(), duration=0.01)
    ground = np.zeros((2, plan.ticks + 1))
    simulate(plan, ground)
    alone = replace(plan, control=replace(plan.control, amd=False))
    simulate(alone, ground, slaves={})
    response(alone, ground)
    still, drive = np.zeros(plan.ticks), np.zeros((plan.ticks, 2))
    for kind in KINDS.values():
        replay.laboratory(kind, System(plan), drive)
    replay.column(System(plan), still)
    replay.building(System(plan), ground, still, still, still)
    substructure.enter(plain(substructure.build(plan, ground)), 0, 0.0, 0.0)
    balance = energy_balance.build(plan.test.interval, 0.5, 1.0, 1.0, np.ones(1))
    energy_balance.enter(plain(balance), 0.0, 0.0, 0.0, 0.0)
    column_lab.enter(plain(column_lab.build(plan.test.interval, plan.actuator, plan.column)), 0.0)
    table_lab.enter(plain(table_lab.build(plan.test.interval, plan.table, plan.damper)), 0.0, 0.0)
    readings.step(readings.build(plan.test.interval, ("any",), {}), 0, 0.0, 0.0, 0.0)
    none = compensators.build("none", {}, plan.test.interval)
    compensators.enter(plain(none), *compensators.STILL, plan.test.interval)
    (cache.folder() / cache.READY).touch()


if __name__ == "__main__":
    compile_all()
    sys.stderr.write(f"kernels compiled into {cache.folder()}\n")
