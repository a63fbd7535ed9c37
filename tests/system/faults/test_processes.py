"""Fault rows F15, F20 and F21: a process of a laboratory is killed or held up."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from tests.faults.rows import passed
from tests.system.faults.bench import INTERVAL, WATCHDOG, Bench, undisturbed
from tests.system.faults.reactions import evidence, exchanged, judge, worst

pytestmark = pytest.mark.faults

HOLD = 25 * INTERVAL  # s


def test_f20_a_killed_slave_brings_the_master_to_rest(tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        with Bench(folder) as bench:
            bench.start_all()
            bench.slave.signal(signal.SIGKILL)
            bench.rest("master")
            found = {"master": judge(bench.finish("master"), bench, "master", ["watchdog"])}
        assert found["master"].cause == "watchdog"
        state = "master safe; the killed one's rig is left to its own watchdog"
        passed("F20", "slave killed", "kill -9 of its process", state, *worst(found), evidence(found))

    undisturbed(scenario, tmp_path)


def test_f21_a_paused_master_finds_both_laboratories_at_rest(tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        with Bench(folder) as bench:
            bench.start_all()
            hold_up(bench.master.pid, HOLD)
            bench.rest("master", "slave")
            run = bench.finish()
            found = {
                "slave": judge(run, bench, "slave", ["watchdog"]),
                "master": judge(run, bench, "master", ["overrun", "remote_trip"], most=HOLD + 2 * WATCHDOG),
            }
        assert found["slave"].cause == "watchdog"
        passed(
            "F21",
            f"master held up {HOLD * 1e3:.0f} ms",
            "SIGSTOP",
            "both safe",
            *worst(found),
            evidence(found),
        )

    undisturbed(scenario, tmp_path)


def test_f15_a_slave_uses_no_stale_command_after_a_pause(tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        with Bench(folder) as bench:
            bench.start_all()
            hold_up(bench.slave.pid, 0.5)
            bench.rest("master", "slave")
            run = bench.finish()
            found = {
                "master": judge(run, bench, "master", ["watchdog"]),
                "slave": judge(run, bench, "slave", ["overrun"], most=0.5 + 2 * WATCHDOG),
            }
        assert exchanged(run, "slave")["commands.turned_away.stale"] > 0
        passed(
            "F15",
            "slave held up 500 ms",
            "SIGSTOP",
            "both safe, stale commands turned away",
            *worst(found),
            evidence(found),
        )

    undisturbed(scenario, tmp_path)


def hold_up(number: int, seconds: float) -> None:
    """Stop a process for a while."""
    os.kill(number, signal.SIGSTOP)
    time.sleep(seconds)
    os.kill(number, signal.SIGCONT)
