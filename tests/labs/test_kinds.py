"""The loops around laboratories of any kind at any place, in virtual time: no slave, no master's rig, two columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from common.plan.plan import Plan
from common.reality.reality import as_planned
from common.recording.reader import read
from common.recording.run import Run
from common.safety.modes import Mode
from laboratories.kinds import topics
from loop import substructure
from loop.closed_loop import simulate
from loop.signals import rows
from rths.examine.replay import replay_master, replay_slaves
from simulation import virtual
from tests.helpers import with_table
from tests.shapes import plan_of

SHAPES = ("two_columns", "two_storeys", "single_site", "two_slaves", "swapped")


def short(shape: str) -> Plan:
    return plan_of(
        shape,
        test={"duration": 0.8},  # the second column's force then still opposes its command at the hold
        ground_motion={"scale": 3.0},
        control={"amd": shape == "swapped"},
    )


def played(plan: Plan, path: Path, *, completed: bool = True) -> tuple[virtual.VirtualTest, Run]:
    bench = virtual.assemble(plan, as_planned(plan), path)
    error = virtual.run(bench, str)
    assert (error is None) == completed, error
    return bench, read(path)


@pytest.mark.parametrize("name", SHAPES)
def test_every_shape_of_test_equals_the_compiled_rollout_and_ends_at_rest(name: str, tmp_path: Path) -> None:
    plan = short(name)
    bench, found = played(plan, tmp_path / "a.mcap")
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    expected: dict[str, list[tuple[object, ...]]] = {}
    for topic, values in rows(plan, simulate(plan, ground, seed=plan.test.seed)):
        expected.setdefault(topic, []).append(values)
    table = topics(plan)
    assert set(expected) == {"master", *plan.roles}
    for topic, lines in expected.items():
        for place, signal in enumerate(table[topic]):
            column = np.array([line[place] for line in lines])
            assert np.array_equal(found.columns[topic][signal.name], column), f"{topic}/{signal.name}"
    assert found.roles == plan.roles
    matches = replay_master(found, plan) | replay_slaves(found, plan)
    assert all(match.differing == 0 and match.compared >= plan.ticks - 1 for match in matches.values())
    assert set(found.ramps) == set(plan.kinds)
    assert {loop.lab.safety.mode for loop in bench.loops.values()} == {Mode.IDLE}
    for role, ramp in found.ramps.items():
        if plan.kinds[role] == "column":
            assert abs(ramp["column_force"][-1]) < 0.1 * abs(found.columns[role]["column_force"]).max()


@pytest.mark.parametrize("role", ["slave.east", "master"])
def test_a_limit_at_either_column_brings_both_to_rest_unloaded(role: str, tmp_path: Path) -> None:
    plan = short("two_columns")
    _, whole = played(plan, tmp_path / "a.mcap")
    force = {lab: abs(whole.columns[lab]["column_force"]).max() for lab in ("master", "slave.east")}
    few = with_table(plan, "limits", column_force=0.5 * force[role])
    bench, found = played(few, tmp_path / "b.mcap", completed=False)
    assert {loop.lab.safety.mode for loop in bench.loops.values()} == {Mode.SAFE}
    event = next(one for one in found.events if one["code"] == "limit")
    assert event["values"].keys() == {"column_force", "limit"}
    for lab, ramp in found.ramps.items():
        assert ramp["actuator_command"].size > 1
        assert abs(ramp["column_force"][-1]) < 0.1 * force[lab]


def test_a_silent_slave_ends_the_test_and_the_other_column_unloads(tmp_path: Path) -> None:
    plan = with_table(short("two_columns"), "link", loss_timeout=0.1)
    plan = with_table(plan, "recording", patience=0.5)
    bench = virtual.assemble(plan, as_planned(plan), tmp_path / "a.mcap")
    virtual.play(bench, pause=lambda: bench.master.ticks >= 200)
    bench.world.process("slave.east").kill()
    virtual.play(bench)
    assert bench.master.lab.safety.mode is Mode.SAFE
    ramp = read(tmp_path / "a.mcap").ramps["master"]
    assert abs(ramp["column_force"][-1]) < 0.1 * abs(ramp["column_force"]).max()
