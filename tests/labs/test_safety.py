"""Both laboratories come to rest in virtual time after limits, failures, stops, and an orderly end."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import EmergencyStopError, RigError
from common.link.endpoint import Received
from common.plan.plan import Plan
from common.protocol.messages import Answer, Message, Operator
from common.reality import reality
from common.recording.reader import read
from common.recording.run import Run
from common.safety.modes import Mode
from report.facts.accounts import accounts
from rths.perform.operate import REPEAT_S
from simulation import virtual
from simulation.virtual import VirtualTest
from tests.faults.rows import motion_after, motion_bound
from tests.helpers import with_table, without_recorder

TRIP = 300  # tick


def played(plan: Plan, path: Path, upset: Any = None) -> tuple[VirtualTest, Run]:
    """A test in virtual time; `upset` is called before every tick."""
    bench = virtual.assemble(plan, reality.as_planned(plan), path)
    if upset is not None:
        ticking = bench.master.tick

        def upsetting(tick: int) -> None:
            upset(bench, tick)
            ticking(tick)

        bench.master.tick = upsetting  # type: ignore[method-assign]
    virtual.run(bench, str)
    return bench, read(path)


def codes(run: Run, lab: str) -> list[str]:
    return [event["code"] for event in run.events if event["lab"] == lab]


def turns(run: Run, lab: str) -> list[str]:
    return [event["text"] for event in run.events if event["lab"] == lab and event["code"] == "mode"]


def test_an_orderly_end_ramps_to_an_unloaded_specimen(short_plan: Plan, tmp_path: Path) -> None:
    bench, run = played(short_plan, tmp_path / "a.mcap")
    for role, loop in bench.loops.items():
        assert loop.lab.safety.mode is Mode.IDLE
        assert turns(run, role)[-2:] == ["running → ramping (end)", "ramping → idle (settled)"]
    ramp = run.ramps["master"]
    assert ramp["seq"][0] == short_plan.ticks
    assert set(ramp["mode"][:-1]) == {"ramping"}
    assert abs(ramp["column_force"][-1]) < 0.1 * abs(run.columns["master"]["column_force"]).max()
    assert run.ramps["slave"]["damper_command"][-1] == 0.0
    assert run.ticks("master") == short_plan.ticks


@pytest.mark.parametrize("lab", ["master", "slave"])
def test_a_violated_limit_is_never_written_and_both_come_to_rest(
    lab: str, short_plan: Plan, tmp_path: Path
) -> None:
    limit, most = {"master": ("column_force", 12e3), "slave": ("damper_stroke", 0.01)}[lab]
    plan = with_table(short_plan, "limits", **{limit: most})
    bench, run = played(plan, tmp_path / "a.mcap")
    other = "slave" if lab == "master" else "master"
    assert {loop.lab.safety.mode for loop in bench.loops.values()} == {Mode.SAFE}
    event = next(event for event in run.events if event["code"] == "limit")
    assert event["lab"] == lab
    assert event["values"]["limit"] == most
    assert abs(event["values"][limit]) == pytest.approx(most, rel=0.2)
    assert codes(run, lab)[-1] != "remote_trip"
    assert "remote_trip" in codes(run, other)
    for role in ("master", "slave"):
        assert "running → ramping (trip)" in turns(run, role)
        assert set(np.diff(run.ramps[role]["seq"])) == {1}  # no interval of the ramp to rest is left out
        assert motion_after(run, role, round(event["t"] / 0.002)) <= motion_bound(plan, role)
        safe = next(one for one in run.events if one["lab"] == role and one["code"] == "safe")
        assert safe["values"]["duration"] > 0.0


def test_a_test_in_virtual_time_does_not_wait_for_an_operators_reset(
    short_plan: Plan, tmp_path: Path
) -> None:
    plan = with_table(short_plan, "limits", column_force=12e3)
    bench, run = played(with_table(plan, "safety", wait_for_reset=True), tmp_path / "a.mcap")
    assert {loop.lab.safety.mode for loop in bench.loops.values()} == {Mode.SAFE}
    assert bench.world.time < (plan.test.duration + 1.0) * 1e9
    assert run.finished


def test_the_ramp_begins_at_the_last_command_without_a_step(short_plan: Plan, tmp_path: Path) -> None:
    plan = with_table(short_plan, "limits", column_force=12e3)
    _, run = played(plan, tmp_path / "a.mcap")
    for role, name in (("master", "actuator_command"), ("slave", "table_command")):
        ramp = run.ramps[role][name]
        commands = run.columns[role][name][run.columns[role]["seq"] < run.ramps[role]["seq"][0]]
        whole = np.concatenate([commands, ramp])
        before = np.abs(np.diff(commands)).max()
        assert np.abs(np.diff(whole)).max() <= before * 1.01
    release = run.ramps["slave"]["damper_command"]
    assert np.flatnonzero(release == 0.0)[0] <= round(0.02 / 0.002)


def test_a_rig_whose_readings_fail_comes_to_rest_without_them(short_plan: Plan, tmp_path: Path) -> None:
    def fail(bench: VirtualTest, tick: int) -> None:
        if tick == TRIP:
            bench.master._rig.read = broken  # type: ignore[method-assign]

    def broken() -> Any:
        raise RigError("load cell gone")

    bench, run = played(short_plan, tmp_path / "a.mcap", fail)
    assert bench.master.lab.safety.mode is bench.slave.lab.safety.mode is Mode.SAFE
    assert np.isnan(run.ramps["master"]["column_force"]).all()
    commands = run.ramps["master"]["actuator_command"]
    assert np.ptp(commands[-20:]) == 0.0


def test_an_emergency_stop_stops_its_own_rig_at_once_and_the_other_by_a_ramp(
    short_plan: Plan, tmp_path: Path
) -> None:
    disarmed: list[int] = []

    def press(bench: VirtualTest, tick: int) -> None:
        if tick == TRIP:
            bench.slave._rig.read = button  # type: ignore[method-assign]
            bench.slave._rig.disarm = disarm  # type: ignore[method-assign]

    def button() -> Any:
        raise EmergencyStopError("mushroom button")

    def disarm() -> None:
        disarmed.append(TRIP)

    bench, run = played(short_plan, tmp_path / "a.mcap", press)
    assert bench.slave.lab.safety.mode is Mode.EMERGENCY_STOP
    assert bench.master.lab.safety.mode is Mode.SAFE
    assert disarmed == [TRIP]
    assert "slave" not in run.ramps or run.ramps["slave"]["seq"].size == 0
    assert "emergency" in codes(run, "slave")


# -- operators --------------------------------------------------------------------------------------


@pytest.fixture
def latched(short_plan: Plan) -> VirtualTest:
    """Both laboratories at rest after a limit, still there."""
    plan = without_recorder(replace(short_plan, limits=replace(short_plan.limits, column_force=12e3)))
    bench = virtual.assemble(plan, reality.as_planned(plan), None)

    def nothing(*, last: bool = False) -> None:
        """Keeps the laboratories from saying goodbye, because they are still there."""

    bench.master.leave = bench.slave.leave = nothing  # type: ignore[method-assign]
    virtual.run(bench, str)
    assert bench.master.lab.safety.latched
    return bench


def pressed(bench: VirtualTest, word: str, press: int, lab: str = "master") -> Answer:
    loop = bench.loops[lab]
    sent: list[Any] = []

    def send(message: Any, to: str = "") -> int:
        sent.append(message)
        return 0

    loop.lab.endpoint.send = send  # type: ignore[method-assign]
    wish = Operator(0, loop.lab.plan.digest(), word, press, "test")
    loop.take(Received(wish, "operator", bench.world.time))
    return next(message for message in sent if isinstance(message, Answer))


def test_a_reset_needs_the_cause_to_be_gone_and_a_new_press(latched: VirtualTest, monkeypatch: Any) -> None:
    loop = latched.master
    monkeypatch.setattr(loop, "standing", lambda: "column_force is beyond its limit.")
    refused = pressed(latched, "reset", 1)
    assert not refused.accepted
    assert "column_force is beyond" in refused.text
    monkeypatch.setattr(loop, "standing", lambda: "")
    assert not pressed(latched, "reset", 1).accepted  # held
    assert loop.lab.safety.latched
    assert pressed(latched, "reset", 2).accepted
    assert not loop.lab.safety.latched


def test_a_reset_pressed_before_the_trip_has_no_effect(short_plan: Plan) -> None:
    plan = without_recorder(short_plan)
    bench = virtual.assemble(plan, reality.as_planned(plan), None)
    answer = pressed(bench, "reset", 7)
    assert not answer.accepted
    assert "nothing to reset" in answer.text


def test_an_operator_with_another_plan_is_ignored(latched: VirtualTest) -> None:
    wish = Operator(0, "another", "reset", 3, "")
    latched.master.take(Received(wish, "operator", latched.world.time))
    assert latched.master.lab.safety.latched


def test_an_emergency_stop_works_at_rest(latched: VirtualTest) -> None:
    assert pressed(latched, "emergency", 4).accepted
    assert latched.master.lab.safety.mode is Mode.EMERGENCY_STOP


# -- accounts ---------------------------------------------------------------------------------------


def test_every_sent_message_is_counted_as_used(short_plan: Plan, tmp_path: Path) -> None:
    _, run = played(short_plan, tmp_path / "a.mcap")
    found = accounts(run)
    ticks = short_plan.ticks
    whole = {"sent": ticks, "used": ticks, "rejected": 0, "lost": 0, "foreign": 0}
    assert found["slave/commands"] == whole
    assert found["slave/feedbacks"] == whole


def test_a_laboratory_that_has_answered_an_operator_stays_for_a_repetition_of_the_order(
    short_plan: Plan,
) -> None:
    plan = without_recorder(short_plan)
    bench, presses = virtual.assemble(plan, reality.as_planned(plan), None), [0]
    slave, answers = bench.slave, list[Answer]()
    ticking, leaving, sending = slave.tick, slave.leave, slave.lab.endpoint.send

    def press() -> None:
        presses.append(bench.world.time)
        wish = Operator(0, plan.digest(), "emergency", 77, "smoke")
        slave.take(Received(wish, "operator", bench.world.time))

    def tick(number: int) -> None:
        if number == TRIP:
            press()
        ticking(number)

    def leave(*, last: bool = False) -> None:
        if len(presses) == 2 and bench.world.time - presses[1] >= REPEAT_S * 1e9:
            press()
        leaving(last=last)

    def send(message: Message, to: str = "") -> int:
        if isinstance(message, Answer):
            answers.append(message)
        return sending(message, to)

    slave.tick, slave.leave, slave.lab.endpoint.send = tick, leave, send  # type: ignore[method-assign, assignment]
    assert isinstance(virtual.run(bench, str), EmergencyStopError)
    assert answers == [Answer(0, 77, 1, "emergency_stop.")] * 2
    assert bench.world.time - presses[-1] < 2e9
