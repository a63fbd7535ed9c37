"""The loops of master and slave with failing rigs, missing partners, late messages and other clocks."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError, InterlockError, LostError, RigError, RthsError
from common.lab.laboratory import REPEAT_NS
from common.link.endpoint import Received
from common.plan.laboratory_tables import RigTable
from common.plan.plan import PROTOCOL_VERSION, Plan
from common.plan.read import from_tables, with_test
from common.protocol.exchange import State
from common.protocol.messages import Command, Feedback, Register, Stop, SyncReply, Trip
from common.reality import reality
from common.reality.reality import Reality
from common.recording.reader import read
from common.safety.modes import Mode
from simulation import virtual
from simulation.virtual import VirtualTest
from simulation.world import Drift
from tests.helpers import running, with_table, without_recorder
from tests.labs.played import run


class BrokenLab:
    """Laboratory A that fails at a given tick in a given way."""

    def __init__(self, interval: float, seed: int, at: int = 300, how: str = "raise") -> None:
        self.tick, self.at, self.how = 0, at, how
        self.disarmed = 0

    def arm(self) -> None:
        if self.how == "arm":
            raise RigError("the pump is off")

    def read(self) -> Any:
        self.tick += 1
        if self.tick <= self.at:
            return 0.0, 0.0
        return {"raise": self._raise, "nan": self._nan, "shape": self._shape, "force": self._force}[
            self.how
        ]()

    def _raise(self) -> Any:
        raise OSError("no answer from the amplifier")

    def _nan(self) -> Any:
        return 0.0, float("nan")

    def _shape(self) -> Any:
        return 0.0, 0.0, 0.0

    def _force(self) -> Any:
        return 0.0, 9e9

    def write(self, command: Any) -> None:
        pass

    def disarm(self) -> None:
        self.disarmed += 1


def broken(plan: Plan, how: str) -> Reality:
    planned = reality.as_planned(plan)
    return dataclasses.replace(planned, master=RigTable(f"{__name__}:BrokenLab", {"how": how}))


@pytest.mark.parametrize(
    ("how", "kind", "sentence"),
    [
        ("raise", RigError, "read() failed: OSError: no answer from the amplifier"),
        ("nan", RigError, "read() returned (0.0, nan), which is not finite"),
        ("shape", RigError, "read() returned 3 numbers, not 2"),
        ("force", InterlockError, "column_force is 9e+09, beyond its limit of 400000"),
        ("arm", RigError, "the pump is off"),
    ],
)
def test_a_rig_that_fails_stops_the_test_with_one_sentence(
    short_plan: Plan, tmp_path: Path, how: str, kind: type[Exception], sentence: str, monkeypatch: Any
) -> None:
    monkeypatch.setattr("loop.rigs.find", lambda *_: BrokenLab)
    found, error, bench = run(short_plan, tmp_path / "broken.mcap", broken(short_plan, how))
    assert isinstance(error, kind)
    assert isinstance(error, RthsError)
    assert sentence in str(error)
    if kind is RigError:
        assert "laboratory A (BrokenLab)" in str(error)
    assert error.exit_code == 3
    assert bench.master.lab.exchange.state is bench.slave.lab.exchange.state is State.TRIPPED
    ticks = 0 if how == "arm" else 301 if how == "force" else 300
    assert found.ticks("master") == ticks
    assert sentence in found.metadata["summary"]["cause"]
    assert any(sentence in event["text"] for event in found.events)


def test_a_slaves_rig_that_fails_stops_the_master_too(
    short_plan: Plan, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.setattr("loop.rigs.find", lambda *_: BrokenLab)
    real = dataclasses.replace(
        reality.as_planned(short_plan), slave=RigTable("x:BrokenLab", {"how": "raise", "at": 0})
    )
    found, error, bench = run(short_plan, tmp_path / "broken.mcap", real)
    assert isinstance(error, RigError)  # the cause, not what the master made of it
    assert "laboratory B (BrokenLab)" in str(error)
    assert bench.slave.lab.exchange.state is State.TRIPPED
    assert isinstance(bench.master.lab.error, InterlockError)
    assert "laboratory B (BrokenLab)" in found.metadata["summary"]["cause"]


def test_an_unstable_test_is_stopped_by_a_limit(default_plan: Plan, tmp_path: Path) -> None:
    plan = with_table(default_plan, "control", amd=False)
    tables = plan.tables() | {"compensator": {"kind": "none"}}
    found, error, _ = run(from_tables(tables, plan.base), tmp_path / "unstable.mcap")
    assert isinstance(error, InterlockError)
    assert "beyond its limit" in str(error)
    assert 0 < found.ticks("master") < plan.ticks
    assert found.finished


def test_another_plan_or_protocol_is_refused_before_anything_moves(short_plan: Plan) -> None:
    for request in (
        Register(5, PROTOCOL_VERSION, with_test(short_plan, scale=0.2).digest()),
        Register(5, PROTOCOL_VERSION + 1, short_plan.digest()),
    ):
        bench = virtual.assemble(without_recorder(short_plan), reality.as_planned(short_plan), None)
        bench.slave.take(Received(request))
        assert bench.slave.lab.exchange.state is State.REFUSED
        assert isinstance(bench.slave.lab.error, InputError)
        heard = bench.endpoints["master"].receive()
        assert heard is not None
        assert "refuse" in type(heard.message).__name__.lower()


def test_a_slave_ignores_a_second_master(short_plan: Plan) -> None:
    plan = without_recorder(short_plan)
    bench = virtual.assemble(plan, reality.as_planned(plan), None)
    bench.slave.take(Received(Register(5, PROTOCOL_VERSION, plan.digest())))
    bench.slave.take(Received(Register(6, PROTOCOL_VERSION, plan.digest())))
    assert bench.slave.lab.exchange.session == 5
    bench.slave.take(Received(Command(6, 0, 0, 0, -1, 1.0, 1.0, 0.0, 0.0, 0.0)))
    bench.slave.take(Received(Trip(6, "master", "x", "y")))
    assert not bench.slave.heard(0)
    assert bench.slave.lab.exchange.state is State.REGISTERED


def test_a_slave_that_does_not_join_is_reported_within_the_connect_timeout(short_plan: Plan) -> None:
    plan = with_table(without_recorder(short_plan), "link", connect_timeout=2.0)
    bench = virtual.assemble(plan, reality.as_planned(plan), None)
    while not bench.master.lab.exchange.ended:
        bench.world.time += 1_000_000
        bench.master.poll()
    assert bench.world.time == pytest.approx(2.0e9, abs=2e6)
    assert isinstance(bench.master.lab.error, LostError)
    assert str(bench.master.lab.error).startswith("No slave joined the test within 2 s")


def test_a_slave_that_joins_and_does_not_arm_is_named(short_plan: Plan) -> None:
    plan = with_table(without_recorder(short_plan), "link", connect_timeout=2.0)
    bench = virtual.assemble(plan, reality.as_planned(plan), None)
    virtual.play(bench, pause=lambda: bench.master.lab.exchange.state is not State.IDLE)
    assert bench.master.lab.exchange.state is State.REGISTERED
    while not bench.master.lab.exchange.ended:
        bench.world.time += 1_000_000
        bench.master.poll()
    assert isinstance(bench.master.lab.error, LostError)
    assert str(bench.master.lab.error).startswith("The slave did not arm its rig within 2 s")


def test_a_missing_recorder_is_reported(short_plan: Plan) -> None:
    plan = with_table(short_plan, "link", connect_timeout=2.0)
    bench = virtual.assemble(plan, reality.as_planned(plan), None)
    error = virtual.run(bench, lambda: "")
    assert isinstance(error, LostError)
    assert str(error).startswith("No recorder joined the test")
    assert bench.master.ticks == 0


@pytest.fixture
def bench(short_plan: Plan) -> VirtualTest:
    return running(without_recorder(short_plan), 100)


def test_a_silent_slave_counts_as_lost_and_nothing_moves_afterwards(bench: VirtualTest) -> None:
    for tick in range(100, 100 + 501):
        bench.world.time = bench.master.lab.tick_ns(tick)
        bench.master.tick(tick)
        if bench.master.lab.exchange.ended:
            break
    assert bench.master.lab.exchange.state is State.LOST
    assert isinstance(bench.master.lab.error, LostError)
    assert tick == 104  # the fifth interval in which nothing of the slave's was new
    assert bench.master.lab.safety.mode is Mode.RAMPING
    assert bench.master.lab.safety.cause is not None
    assert bench.master.lab.safety.cause.code == "watchdog"


@pytest.mark.parametrize(("done", "completed"), [(1000, True), (999, False)])
def test_a_slave_with_a_rig_that_is_a_few_ticks_behind_takes_the_masters_end_as_a_completed_test(
    done: int, completed: bool, bench: VirtualTest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Plan, "emulated", property(lambda _: False))
    assert not bench.slave.completed
    plan, session = bench.slave.lab.plan, bench.slave.lab.exchange.session
    request = Stop(session, plan.ticks - 1000 + done, "completed")
    bench.slave.take(Received(request, "master"))
    assert bench.slave.ticks < plan.ticks
    assert bench.slave.completed is completed


def test_a_clock_exchange_that_is_repeated_and_answered_twice_does_not_count_as_lost(
    short_plan: Plan,
) -> None:
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), None)
    partner = bench.master.partners["slave"]
    partner.synchronise(0)
    partner.synchronise(REPEAT_NS)
    assert partner.lost == 2
    answer = SyncReply(bench.master.lab.exchange.session, 0, 0, 0)
    assert partner.take_sync(answer, REPEAT_NS + 1)
    assert not partner.take_sync(answer, REPEAT_NS + 2)
    assert not partner.take_sync(answer, REPEAT_NS + 3)
    assert partner.lost == 0


def test_a_slave_without_commands_holds_the_last_one_and_measures_until_it_ramps(
    bench: VirtualTest,
) -> None:
    before = bench.slave._command
    for tick in range(100, 105):
        bench.world.time = bench.slave.tick_ns(tick)
        bench.slave.tick(tick)
    answers = []
    while (heard := bench.endpoints["master"].receive()) is not None:
        answers.append(heard.message)
    feedback = [answer for answer in answers if isinstance(answer, Feedback) and answer.seq >= 100]
    assert [answer.seq for answer in feedback] == list(range(100, 104))
    assert {answer.command_seq for answer in feedback} == {before.seq}
    assert bench.slave.lab.safety.mode is Mode.RAMPING


def test_a_tick_that_is_a_whole_interval_late_moves_nothing_and_sends_nothing(bench: VirtualTest) -> None:
    command = bench.master._command
    while bench.endpoints["slave"].receive() is not None:
        pass
    bench.world.time = bench.master.lab.tick_ns(103) + 1
    for tick in (100, 101, 102):
        bench.master.tick(tick)
        assert bench.master._command == command
    assert bench.endpoints["slave"].receive() is None
    bench.master.tick(103)
    assert bench.master._command != command
    heard = bench.endpoints["slave"].receive()
    assert heard is not None
    assert isinstance(heard.message, Command)
    assert heard.message.seq == 103


def test_repeated_and_outdated_feedback_is_not_used(bench: VirtualTest) -> None:
    session = bench.master.lab.exchange.session
    used = bench.master.partners["slave"].used
    for seq in (used.seq, used.seq - 5):
        bench.master.take(
            Received(Feedback(session, seq, seq, 0, -1, 0, 0, 0, (0.0, 0.0, 0.0, 999.0)), "slave")
        )
    bench.world.time = bench.master.lab.tick_ns(100)
    bench.master.tick(100)
    assert bench.master.partners["slave"].force != 999.0


def test_feedback_of_another_session_is_not_used(bench: VirtualTest) -> None:
    bench.master.take(Received(Feedback(12345, 99, 99, 0, -1, 0, 0, 0, (0.0, 0.0, 0.0, 999.0)), "slave"))
    bench.world.time = bench.master.lab.tick_ns(100)
    bench.master.tick(100)
    assert bench.master.partners["slave"].force != 999.0


class SlowLink:
    """Every third feedback three milliseconds late."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        return 0.003 if direction == "feedback" and seq % 3 == 0 else None if seq % 50 == 7 else 0.0


def test_a_link_plug_in_delays_and_loses_messages(short_plan: Plan, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr("loop.links.find", lambda *_: SlowLink)
    real = dataclasses.replace(reality.as_planned(short_plan), link=RigTable("x:SlowLink"))
    found, error, _ = run(short_plan, tmp_path / "slow.mcap", real)
    assert error is None
    used = found.columns["master"]["damper_force_seq"]
    # the feedback of tick 30 (a multiple of three) would be used at 31, comes at 33, when 32 is there: never used
    assert used[30:36].tolist() == [29, 29, 31, 32, 32, 34]
    assert found.columns["slave"]["command_seq"][55:59].tolist() == [55, 56, 56, 58]
    ages = found.columns["master"]["damper_force_age"]
    assert np.allclose(ages[30:36], [0.002, 0.004, 0.002, 0.002, 0.004, 0.002])


def test_clock_offset_and_drift_do_not_shift_the_laboratories_in_time(
    short_plan: Plan, tmp_path: Path
) -> None:
    gain = 500e-6  # a millisecond in two seconds
    path = tmp_path / "skewed.mcap"
    drifts = {"slave": Drift(1_000_000_000, round(gain * 1e9))}  # a second ahead, and gaining
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), path, drifts=drifts)
    assert virtual.run(bench, lambda: "") is None
    found = read(path)
    assert found.columns["slave"]["command_seq"].tolist() == list(range(short_plan.ticks))
    latency = found.columns["latency"]
    assert np.all(latency["deadline_missed"] == 0)
    truth = 1.0 + gain * (latency["tick_ns"] * 1e-9)
    # so fast a drift leaves the line at the edge of what its bound allows
    assert np.allclose(latency["clock_offset"], truth, atol=0.15e-3)
    assert bench.slave._shift_ns == pytest.approx(gain * 4e9, abs=0.15e6)


class OneWay:
    """Every feedback five milliseconds late, no command."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        return 0.005 if direction == "feedback" else 0.0


def test_a_plug_ins_delay_is_in_the_time_stamps_and_not_in_the_clock_offset(
    short_plan: Plan, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.setattr("loop.links.find", lambda *_: OneWay)
    real = dataclasses.replace(reality.as_planned(short_plan), link=RigTable("x:OneWay"))
    path = tmp_path / "one_way.mcap"
    bench = virtual.assemble(short_plan, real, path, drifts={"slave": Drift(1_000_000_000)})
    assert virtual.run(bench, lambda: "") is None
    latency = read(path).columns["latency"]
    assert latency["seq"].tolist() == list(range(short_plan.ticks))
    assert np.all(latency["clock_offset"] == 1.0)
    assert np.allclose(latency["command_one_way"], 0.0, atol=1e-9)
    assert np.allclose(latency["feedback_one_way"], 0.005, atol=1e-9)
    assert np.allclose(latency["round_trip"], 0.005, atol=1e-9)
    assert np.all(latency["feedback_received_ns"] - latency["command_sent_ns"] == 5_000_000)
    assert np.all(latency["deadline_missed"])  # the answer was not there for the next tick


@pytest.mark.parametrize("ticks", [0, 700])
def test_early_stop_by_the_user_is_orderly(ticks: int, short_plan: Plan, tmp_path: Path) -> None:
    path = tmp_path / "stopped.mcap"
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), path)
    error = virtual.run(bench, lambda: "stopped by the user." if bench.master.ticks >= ticks else "")
    found = read(path)
    assert str(error) == "stopped by the user."
    assert bench.master.lab.exchange.state is bench.slave.lab.exchange.state is State.DONE
    assert found.ticks("master") == found.ticks("slave") == ticks
    assert found.metadata["summary"]["cause"] == "stopped by the user."
