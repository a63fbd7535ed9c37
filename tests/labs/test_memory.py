"""The memory and the open files of all three processes while a test goes on, in virtual time."""

from __future__ import annotations

import gc
import tracemalloc
from pathlib import Path

import pytest

from common.lab.outlet import kept_seconds
from common.plan.plan import Plan
from common.reality import reality
from laboratories.sensors.noise import BLOCK
from simulation import virtual
from tests.helpers import with_table

# ticks from which on the most is taken that is held in a block of them: noise is drawn in such blocks, and what waits
# for the file grows and is written again several times in each; before 2^32 ns a packed stamp is shorter than after
FROM, TO = 4 * BLOCK, 6 * BLOCK
KEPT_FROM = 2**32 * 1e-9  # s
MOST = 8.0  # bytes a tick; the recording's index takes 1.5


@pytest.mark.slow
def test_memory_use_does_not_grow_during_a_test(default_plan: Plan, tmp_path: Path) -> None:
    plan = with_table(default_plan.with_ticks(TO + BLOCK), "recording", patience=0.5)
    assert KEPT_FROM + kept_seconds(plan) < FROM * plan.test.interval
    bench = virtual.assemble(plan, reality.as_planned(plan), tmp_path / "a.mcap")
    held = {FROM: 0, TO: 0}

    def measured() -> str:
        for begin, most in held.items():
            if begin <= bench.master.ticks < begin + BLOCK:
                held[begin] = max(most, tracemalloc.get_traced_memory()[0])
        return ""

    gc.collect()
    gc.disable()  # as the laboratories do: what refers to itself would stay
    tracemalloc.start()
    try:
        assert virtual.run(bench, measured) is None
    finally:
        tracemalloc.stop()
        gc.enable()
    assert (held[TO] - held[FROM]) / (TO - FROM) < MOST
