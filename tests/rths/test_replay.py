"""`rths replay` of tests with other kinds of laboratory: equal to the last bit, and one changed bit is found."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError
from common.plan.read import load, with_test
from common.reality.reality import as_planned
from common.recording.reader import read
from common.recording.run import Run
from common.terminal.cli import plan_path
from rths.examine import replay
from simulation import virtual
from tests.helpers import ROOT

DEVICE = ROOT / "examples" / "viscous_damper.toml"


@pytest.fixture(scope="module")
def device(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("device") / "a.mcap"
    plan = with_test(load(DEVICE), duration=1.0)
    assert virtual.run(virtual.assemble(plan, as_planned(plan), path), str) is None
    return path


def test_a_users_kind_is_replayed_where_its_class_is_available(call: Any, capsys: Any, device: Path) -> None:
    assert call("replay", device) == 2
    assert "There is no file" in capsys.readouterr().err
    assert call("replay", device, "--plan", DEVICE, "--json") == 0
    signals = json.loads(capsys.readouterr().out)["signals"]
    assert {"slave/piston_command", "master/piston_force_used", "master/piston_target_jerk"} <= signals.keys()
    assert min(match["compared"] for match in signals.values()) == 499


@pytest.mark.parametrize(
    ("topic", "name", "differs"),
    [
        ("master", "piston_force_used", "master/piston_force_used"),
        ("slave", "piston_target", "slave/piston_target"),
        ("slave", "piston_command", "slave/piston_command"),
    ],
)
def test_one_changed_bit_of_a_users_kind_is_found(topic: str, name: str, differs: str, device: Path) -> None:
    found = read(device)
    values = found.columns[topic][name]
    values[200] = np.nextafter(values[200], np.inf)
    plan = replay.planned(found, str(DEVICE))
    matches = replay.replay_master(found, plan) | replay.replay_slaves(found, plan)
    assert matches[differs].differing


def test_without_slaves_a_tick_counts_as_held_if_its_command_equals_the_previous_one() -> None:
    alone = Run(Path("a.mcap"), roles=())
    assert replay.held_ticks(alone, [0.1, 0.2, 0.2, 0.3]) == {2}


def test_ticks_held_before_the_first_command_to_several_slaves_are_replayed(tmp_path: Path) -> None:
    plan = with_test(load(plan_path("two_dampers")), duration=0.1)
    assert virtual.run(virtual.assemble(plan, as_planned(plan), tmp_path / "a.mcap"), str) is None
    found = read(tmp_path / "a.mcap")
    names = replay.ComputedSignals(plan).held
    for topic in ("latency.roof", "latency.middle"):
        found.columns[topic]["command_sent_ns"][:2] = 0
    for name in names:
        found.columns["master"][name][:2] = 0.0
    matches = replay.replay_master(found, plan)
    assert found.columns["master"]["table_target"].shape == (50, 2)
    assert not any(match.differing for match in matches.values())


@pytest.mark.parametrize("topic", ["master", "slave", "latency"])
def test_a_recording_that_lacks_any_one_signal_is_replayed_as_far_as_it_goes(
    topic: str, device: Path
) -> None:
    whole, other = read(device), str(DEVICE)
    everything = replay.replay_master(whole, replay.planned(whole, other))
    everything |= replay.replay_slaves(whole, replay.planned(whole, other))
    needed = {"seq", "t", "piston_force_used"}
    for name in whole.columns[topic]:
        fewer = {key: values for key, values in whole.columns[topic].items() if key != name}
        run = replace(whole, columns=whole.columns | {topic: fewer})
        if topic == "master" and name in needed:
            with pytest.raises(InputError, match=f"lack {name}"):
                replay.planned(run, other)
            continue
        plan = replay.planned(run, other)
        matches = replay.replay_master(run, plan) | replay.replay_slaves(run, plan)
        assert matches.keys() == everything.keys()
        assert not any(match.differing for match in matches.values())
        if f"{topic}/{name}" in matches:
            assert matches[f"{topic}/{name}"].compared == 0


def test_what_was_not_recorded_is_said_not_to_be_compared(capsys: Any, device: Path) -> None:
    run = read(device)
    del run.columns["slave"]["piston_command"]
    plan = replay.planned(run, str(DEVICE))
    replay.show(replay.replay_slaves(run, plan), True)
    assert "not recorded, and not compared: slave/piston_command" in capsys.readouterr().out
