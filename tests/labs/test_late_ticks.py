"""Processes that the host pauses, on a simulated clock: what an emulation makes good, and what a rig's figures stop."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan import patience, reality
from common.plan.plan import Plan
from common.plan.read import parse
from common.recording.reader import Run, read
from common.roles import MASTER, SLAVE
from report.facts.summary import summarize
from validation.faults.lab import Simulation, Surrounding

EMULATED = parse("[test]\nduration = 2.6\n", Path())
PAUSE = 0.05  # s
STRONG = (0.9, 1.4, 1.65, 1.9, 2.2, 2.4)  # s, up to the strongest motion of the record


def played(plan: Plan, path: Path, pauses: dict[str, tuple[float, ...]], seconds: float = PAUSE) -> Run:
    """The recording of a test whose processes stand still now and then; times from about the first tick."""
    simulation = Simulation(plan, reality.as_planned(plan), Surrounding(seed=1, recording=path))
    world, master = simulation.world, simulation.loops[MASTER].lab

    def lay() -> None:
        if not master.start_ns:
            world.at(world.time + 10_000_000, lay)
            return
        begin = world.processes[MASTER].reached(master.start_ns)
        for role, times in pauses.items():
            for t in times:
                world.at(begin + round(t * 1e9), world.processes[role].stall, round(seconds * 1e9))

    world.at(0, lay)
    simulation.run()
    return read(path)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The same test on a machine that pauses nobody."""
    return played(EMULATED, tmp_path_factory.mktemp("undisturbed") / "a.mcap", {})


@pytest.mark.parametrize("paused", [(MASTER,), (SLAVE,), (MASTER, SLAVE)])
def test_an_emulation_bears_pauses_of_50_ms_and_counts_them(
    paused: tuple[str, ...], tmp_path: Path, undisturbed: Run
) -> None:
    run = played(EMULATED, tmp_path / "a.mcap", dict.fromkeys(paused, STRONG))
    summary = summarize(run)
    assert summary["recorder"]["cause"] == "completed"
    assert all(facts["missing"] == 0 for facts in summary["topics"].values())
    assert summary["missed_ticks"] == 0  # each tick of the master moved its rig and sent its command
    assert summary["late_ticks"] >= 24 * len(STRONG)
    assert [event["code"] for event in run.events if event["code"] == "late"] == ["late"]
    assert summary["warnings"]
    assert len(summary["rejected"]) == 0
    column = run.columns["master"]["column_displacement"]
    still = undisturbed.columns["master"]["column_displacement"]
    assert np.max(np.abs(column - still)) < 0.2 * np.max(np.abs(still))  # the damper alone is late


def test_what_is_patient_is_told_with_its_reason(undisturbed: Run) -> None:
    summary: Any = summarize(undisturbed)
    assert summary["patience"] == patience.sentence(EMULATED) == undisturbed.metadata["summary"]["patience"]
    assert summary["warnings"] == []
    assert summary["late_ticks"] == 0


def test_with_the_figures_of_a_rig_the_same_pause_ends_the_test(tmp_path: Path) -> None:
    run = played(patience.strict(EMULATED), tmp_path / "a.mcap", {MASTER: (2.2,)})
    assert run.metadata["summary"]["outcome"] in ("overrun", "watchdog")
    assert "patience" not in run.metadata["summary"]


def test_a_pause_beyond_the_patience_ends_an_emulation_too(tmp_path: Path) -> None:
    run = played(EMULATED, tmp_path / "a.mcap", {SLAVE: (0.2,)}, seconds=1.15 * patience.PATIENCE)
    assert {event["code"] for event in run.events if event["level"] == "error"} >= {"watchdog", "overrun"}
