"""Processes that the host pauses, on a simulated clock: emulated laboratories catch up, a rig stops the test."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan import patience
from common.plan import read as plans
from common.plan.kinds import COLUMN
from common.plan.plan import Plan
from common.plan.read import parse
from common.reality import reality
from common.recording.reader import read
from common.recording.run import Run
from common.roles import MASTER, SLAVE
from common.terminal import cli
from report.facts.summary import summarize
from tests.helpers import PATIENT, ROOT
from validation.faults.lab import Simulation, Surrounding

EMULATED = parse("[test]\nduration = 2.6\n", Path())
PAUSE = 0.05  # s
SWINGS = 1.7  # s, the damper moves fast and the motor pushes on
STRONG = (0.9, 1.4, 1.65, 1.9, 2.2, 2.4)  # s, up to the strongest motion of the record


def played(plan: Plan, path: Path, pauses: dict[str, tuple[float, ...]], seconds: float = PAUSE) -> Run:
    """The recording of a test whose processes are paused at these times, counted from about the first tick."""
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
def test_an_emulated_test_tolerates_pauses_of_50_ms_and_counts_them(
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


def test_an_emulated_test_tolerates_the_dampers_swing_while_the_master_pauses_for_half_a_second(
    tmp_path: Path,
) -> None:
    run = played(EMULATED, tmp_path / "a.mcap", {MASTER: (SWINGS,)}, seconds=0.5)
    assert run.metadata["summary"]["cause"] == "completed"
    stroke = np.max(np.abs(run.columns["slave"]["damper_stroke"]))
    assert patience.standard("limits.damper_stroke") < stroke < EMULATED.limits.damper_stroke


@pytest.mark.parametrize("tables", ["", PATIENT], ids=["late ticks caught up", "late ticks held"])
def test_an_emulated_slave_that_is_behind_when_the_master_ends_runs_its_last_ticks(
    tables: str, tmp_path: Path
) -> None:
    plan = parse(f"[test]\nduration = 0.5\n{tables}", Path())
    run = played(plan, tmp_path / "a.mcap", {SLAVE: (0.48,)}, seconds=0.5)
    summary = summarize(run)
    assert summary["recorder"]["cause"] == "completed"
    assert all(facts["missing"] == 0 for facts in summary["topics"].values())


# a plan, its slave, and the limits on how the command of that slave moves, beside a rig
SLAVES_OF_OTHER_KINDS: dict[str, tuple[Path, str, dict[str, Any]]] = {
    "column": (
        cli.plan_path("two_columns"),
        "slave.east",
        {"limits": {name: patience.standard(f"limits.{name}") for name in patience.OF_KIND[COLUMN]}},
    ),
    "device": (
        ROOT / "examples" / "viscous_damper.toml",
        SLAVE,
        {"device": {"limits": {"piston_velocity": 1.0, "piston_error": 0.02}}},
    ),
}


@pytest.mark.parametrize("kind", SLAVES_OF_OTHER_KINDS)
def test_a_slave_of_another_kind_tolerates_pauses(kind: str, tmp_path: Path) -> None:
    file, role, _ = SLAVES_OF_OTHER_KINDS[kind]
    plan = plans.with_test(plans.load(file), duration=EMULATED.test.duration)
    summary = summarize(played(plan, tmp_path / "a.mcap", {MASTER: STRONG[::2], role: STRONG[1::2]}))
    assert summary["recorder"]["cause"] == "completed"
    assert summary["late_ticks"] >= 24 * len(STRONG)


@pytest.mark.parametrize("kind", SLAVES_OF_OTHER_KINDS)
def test_limits_given_in_the_plan_stop_a_slave_of_another_kind_after_a_pause(
    kind: str, tmp_path: Path
) -> None:
    file, _, strict = SLAVES_OF_OTHER_KINDS[kind]
    plan = plans.load(file)
    tables = plan.written()
    tables = tables | {name: tables[name] | values for name, values in strict.items()}
    plan = plans.with_test(plans.from_tables(tables, plan.base), duration=EMULATED.test.duration)
    run = played(plan, tmp_path / "a.mcap", {MASTER: STRONG})
    (limit,) = [event for event in run.events if event["code"] == "limit"]
    assert any(name.endswith("_velocity") for name in limit["values"])
    assert limit["text"].endswith(" m/s.")


def test_the_summary_states_the_relaxed_limits_with_their_reason(undisturbed: Run) -> None:
    summary: Any = summarize(undisturbed)
    assert summary["patience"] == patience.sentence(EMULATED) == undisturbed.metadata["summary"]["patience"]
    assert summary["warnings"] == []
    assert summary["late_ticks"] == 0


def test_with_the_limits_of_a_rig_the_same_pause_ends_the_test(tmp_path: Path) -> None:
    run = played(patience.strict(EMULATED), tmp_path / "a.mcap", {MASTER: (2.2,)})
    assert run.metadata["summary"]["outcome"] in ("overrun", "watchdog")
    assert "patience" not in run.metadata["summary"]


def test_a_pause_beyond_the_relaxed_limits_ends_an_emulated_test(tmp_path: Path) -> None:
    run = played(EMULATED, tmp_path / "a.mcap", {SLAVE: (0.2,)}, seconds=1.15 * patience.PATIENCE)
    assert {event["code"] for event in run.events if event["level"] == "error"} >= {"watchdog", "overrun"}
