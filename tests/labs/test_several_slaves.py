"""Several slaves on one master, over a link in memory, in virtual time."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError, InterlockError, LostError, RigError
from common.lab.laboratory import Setting
from common.link.endpoint import Received
from common.plan import read as plans
from common.plan.laboratory_tables import RigTable
from common.plan.patience import strict
from common.plan.plan import PROTOCOL_VERSION, Plan
from common.plan.read import from_tables, with_test
from common.protocol.exchange import State
from common.protocol.messages import Arm, Feedback, Recorder, Register, Start, Sync, Waiting
from common.reality import reality
from common.recording.reader import read
from common.recording.run import Run
from common.terminal import cli
from loop import substructure
from loop.closed_loop import simulate
from loop.signals import signals
from rths.examine.replay import planned, replay_master, replay_slaves
from simulation import virtual
from slave.assembly import build_loop as build_slave
from tests.helpers import largest, running, without_recorder
from tests.labs.played import run

THREE = {"mass": [1.6e5] * 3, "stiffness": [9e7] * 3, "damping": [4e5] * 3}


def tall(*names: str, duration: float = 2.0) -> Plan:
    """A plan of three storeys with a slave of each name, dampers of different masses on different floors."""
    slaves = {
        name: {
            "damper": {"floor": 1 + place % 3, "mass": 12.0 + place},
            "control": {"gain": 1.2e5 / len(names)},
        }
        for place, name in enumerate(names)
    }
    tables = {
        "test": {"name": "tall", "duration": duration},
        "structure": THREE,
        "column": {"stiffness": 45e6},
    }
    return from_tables(tables | {"slave": slaves}, Path())


TWO = tall("roof", "middle")


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Run:
    found, error, _ = run(TWO, tmp_path_factory.mktemp("two") / "two.mcap")
    assert error is None
    return found


def replays(found: Run) -> bool:
    matches = replay_master(found, planned(found)) | replay_slaves(found, planned(found))
    assert {f"{role}/table_command" for role in found.roles} <= matches.keys()
    return all(match.differing == 0 and match.compared > 0 for match in matches.values())


@pytest.mark.parametrize("count", [1, 2, 4, 8, 16])
def test_a_test_with_any_number_of_slaves_is_recorded_completely_and_replayed_to_the_last_bit(
    count: int, tmp_path: Path
) -> None:
    chosen = tall(*(f"lab{place}" for place in range(count)), duration=1.0)
    found, error, _ = run(chosen, tmp_path / "a.mcap")
    assert error is None
    assert found.roles == chosen.roles
    for topic in ("master", *chosen.roles, *(f"latency.lab{place}" for place in range(count))):
        assert found.sequences[topic].tolist() == list(range(chosen.ticks))
        assert found.metadata["summary"][f"{topic}_recorded"] == str(chosen.ticks)
    shape = (chosen.ticks, count) if count > 1 else (chosen.ticks,)
    assert found.columns["master"]["damper_force_used"].shape == shape
    assert replays(found)


def test_both_ends_of_every_exchange_are_recorded_and_each_slave_gets_only_its_own_commands(
    recording: Run,
) -> None:
    for place, role in enumerate(recording.roles):
        for name in ("table_target", "damper_command", "table_target_jerk"):
            sent = recording.columns["master"][name][:, place]
            assert np.array_equal(sent, recording.columns[role][name]), f"{role}/{name}"
        used = recording.columns["master"]["damper_force_used"][1:, place]
        assert np.array_equal(used, recording.columns[role]["damper_force"][:-1])
    assert largest(np.diff(recording.columns["master"]["table_target"], axis=1)) > 1e-4


def test_a_single_named_slave_gives_the_same_test_as_an_unnamed_one(
    short_plan: Plan, virtual_recording: Path, tmp_path: Path
) -> None:
    chosen = from_tables(short_plan.tables() | {"slave": {"roof": {}}}, short_plan.base)
    found, error, _ = run(chosen, tmp_path / "named.mcap")
    assert error is None
    unnamed, named = read(virtual_recording), found.of("slave.roof")
    for topic in ("master", "slave"):
        for name, values in unnamed.columns[topic].items():
            assert np.array_equal(values, named.columns[topic][name]), f"{topic}/{name}"


def test_two_slaves_with_half_a_damper_each_equal_one_slave_with_the_whole(short_plan: Plan) -> None:
    half = {
        "damper": {"force_scale": short_plan.damper.force_scale / 2},
        "control": {"gain": short_plan.control.gain / 2},
    }
    chosen = from_tables(short_plan.tables() | {"slave": {"left": half, "right": half}}, short_plan.base)
    ground = substructure.ground_rows(short_plan, substructure.motion(short_plan))
    found = simulate(chosen, ground)
    whole = signals(short_plan, simulate(short_plan, ground))
    assert np.allclose(found.master["displacement"], whole["displacement"], rtol=0.0, atol=1e-15)
    for columns in found.slaves.values():
        assert np.allclose(columns["damper_stroke"], whole["damper_stroke"], rtol=0.0, atol=1e-13)


def test_the_first_of_two_slaves_has_the_same_noise_as_a_single_slave(tmp_path: Path) -> None:
    one, _, _ = run(tall("roof"), tmp_path / "one.mcap")
    two, _, _ = run(TWO, tmp_path / "two.mcap")
    noise = [
        found.columns[role]["damper_force"][0] for found, role in ((one, "slave.roof"), (two, "slave.roof"))
    ]
    assert noise[0] == noise[1] != two.columns["slave.middle"]["damper_force"][0]


class LateRoof:
    """Every third feedback three milliseconds late, where an option says so."""

    def __init__(self, seed: int) -> None:
        self.late = seed == TWO.test.seed  # the first slave's link has the plan's own seed

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        return 0.003 if self.late and direction == "feedback" and seq % 3 == 0 else 0.0


def test_late_messages_of_one_slave_affect_that_slave_only(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr("loop.links.find", lambda *_: LateRoof)
    real = dataclasses.replace(reality.as_planned(TWO), link=RigTable("x:LateRoof"))
    found, error, _ = run(TWO, tmp_path / "late.mcap", real)
    assert error is None
    used = found.columns["master"]["damper_force_seq"]
    assert used[30:36, 0].tolist() == [29, 29, 31, 32, 32, 34]
    assert used[:, 1].tolist() == list(range(-1, TWO.ticks - 1))
    assert np.allclose(found.columns["master"]["damper_force_age"][31], [0.004, 0.002])
    assert np.count_nonzero(found.columns["latency.roof"]["deadline_missed"]) > TWO.ticks / 4
    assert not np.any(found.columns["latency.middle"]["deadline_missed"])
    assert replays(found)


def test_an_effect_on_one_slave_applies_to_that_slave_only(recording: Run, tmp_path: Path) -> None:
    path = tmp_path / "reality.toml"
    path.write_text("[[effect]]\nname = 'sensor.damper_stroke.bias'\noffset = 0.2\nslave = 'middle'\n")
    found, error, _ = run(TWO, tmp_path / "biased.mcap", reality.load(path, TWO))
    assert error is None or isinstance(error, InterlockError)
    assert found.columns["slave.middle"]["damper_stroke"][0] == pytest.approx(0.2, abs=1e-3)
    assert (
        found.columns["slave.roof"]["damper_stroke"][0] == recording.columns["slave.roof"]["damper_stroke"][0]
    )
    assert "bias" not in repr(found.metadata) + repr(found.events)


def test_an_effect_on_the_building_that_names_a_slave_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "reality.toml"
    path.write_text("[[effect]]\nname = 'structure.mass'\nfactor = 1.1\nslave = 'roof'\n")
    with pytest.raises(
        InputError, match=r"'structure.mass' does not belong to one slave: leave out its slave"
    ):
        virtual.assemble(TWO, reality.load(path, TWO), None)


class BrokenTable:
    """A laboratory B whose rig fails at a given tick."""

    def __init__(self, interval: float, seed: int) -> None:
        self.tick = 0

    def arm(self) -> None:
        pass

    def read(self) -> Any:
        self.tick += 1
        if self.tick > 100:
            raise OSError("the amplifier is off")
        return 0.0, 0.0, 0.0, 0.0

    def write(self, command: Any) -> None:
        pass

    def disarm(self) -> None:
        pass


@pytest.mark.parametrize("hidden", [True, False])
def test_a_slave_that_trips_ends_the_test_for_all_and_the_sentence_names_it(
    hidden: bool, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.setattr("loop.rigs.find", lambda *_: BrokenTable)
    real = reality.as_planned(TWO)
    real = dataclasses.replace(
        real,
        slaves=real.slaves | {"slave.middle": RigTable("x:BrokenTable")},
        hidden=frozenset({"slave.middle"} if hidden else ()),
    )
    found, error, bench = run(TWO, tmp_path / "a.mcap", real)
    assert isinstance(error, RigError)
    assert str(error).startswith("laboratory B of the slave 'middle'")
    ended = bench.master.lab.error
    assert isinstance(ended, InterlockError)
    assert str(ended).startswith("The slave 'middle' stopped the test: laboratory B of the slave 'middle'")
    assert all(loop.lab.exchange.state is State.TRIPPED for loop in bench.loops.values())
    assert ("BrokenTable" in repr(found.events)) is not hidden
    assert (
        "the amplifier is off" in repr(found.events)
    ) is not hidden  # a hidden rig might quote its options
    assert {event["lab"] for event in found.events} >= {"master", "slave.middle", "slave.roof"}


def test_a_slave_that_falls_silent_is_named_and_all_others_are_told() -> None:
    bench = running(without_recorder(strict(TWO)), 100)
    bench.slaves["slave.middle"].tick = lambda tick: None  # type: ignore[method-assign]
    virtual.play(bench, pause=lambda: bench.master.lab.exchange.ended)
    assert bench.master.lab.exchange.state is State.LOST
    assert isinstance(bench.master.lab.error, LostError)
    assert str(bench.master.lab.error) == "No valid feedback from the slave 'middle' for 10 ms."
    virtual.play(bench, pause=lambda: all(slave.lab.exchange.ended for slave in bench.slaves.values()))
    assert all(slave.lab.exchange.state is State.TRIPPED for slave in bench.slaves.values())
    roof = bench.slaves["slave.roof"].lab.error
    assert str(roof).startswith("The master stopped the test: No valid feedback from the slave 'middle'")


def test_a_slave_that_never_joins_is_named_with_the_command_that_starts_it() -> None:
    chosen = dataclasses.replace(
        without_recorder(TWO), link=dataclasses.replace(TWO.link, connect_timeout=2.0)
    )
    bench = virtual.assemble(chosen, reality.as_planned(chosen), None)
    middle = bench.slaves.pop("slave.middle")
    virtual.play(bench, pause=lambda: bench.master.lab.exchange.ended and bench.slave.lab.exchange.ended)
    assert str(bench.master.lab.error) == (
        "No slave 'middle' joined the test within 2 s: start it with the same plan, --name middle and --connect."
    )
    assert middle.lab.exchange.state is State.IDLE
    assert bench.slave.lab.exchange.state is State.TRIPPED


def test_slaves_are_armed_only_after_all_have_registered() -> None:
    bench = virtual.assemble(without_recorder(TWO), reality.as_planned(TWO), None)
    late = bench.slaves.pop("slave.middle")
    virtual.play(bench, pause=lambda: bench.world.time > 500_000_000)
    assert bench.master.lab.exchange.state is State.IDLE
    assert bench.slave.lab.exchange.state is State.REGISTERED
    bench.slaves["slave.middle"] = late
    virtual.play(bench, pause=lambda: all(loop.lab.running for loop in bench.loops.values()))
    assert bench.master.lab.running
    assert {slave.lab.start_ns for slave in bench.slaves.values()} == {bench.master.lab.start_ns}


def test_a_feedback_is_used_only_for_the_slave_that_sent_it() -> None:
    bench = running(without_recorder(TWO), 100)
    session = bench.master.lab.exchange.session
    roof, middle = bench.master.partners.values()
    forged = Feedback(session, 99, 99, 0, -1, 0, 0, 0, (0.0, 0.0, 0.0, 999.0))
    now = bench.world.time
    bench.master.take(Received(forged._replace(seq=100), "slave.roof", now))
    bench.master.take(Received(forged._replace(seq=100), "slave.nobody", now))
    bench.world.time = bench.master.lab.tick_ns(101)
    bench.master.tick(101)
    assert roof.force == 999.0
    assert middle.force != 999.0


# -- one name, two processes ------------------------------------------------------------------------


@pytest.mark.parametrize("named", [True, False])
def test_a_second_process_of_the_same_slave_is_refused_and_the_test_goes_on(
    named: bool, short_plan: Plan
) -> None:
    chosen = without_recorder(TWO if named else short_plan)
    bench = running(chosen, 100)
    role = chosen.roles[0]
    real = reality.as_planned(chosen).of(role)
    second = build_slave(Setting(chosen, bench.endpoints[role], bench.slave.lab.clock), real)
    second.poll()
    heard = bench.endpoints["master"].receive()
    while heard is not None and not isinstance(heard.message, Waiting):
        heard = bench.endpoints["master"].receive()
    assert heard is not None
    bench.master.take(heard)
    told = bench.endpoints[role].receive()
    while told is not None and not isinstance(told.message, Arm):
        told = bench.endpoints[role].receive()
    assert told is not None
    second.take(told)
    bench.slave.take(told)
    assert second.lab.exchange.state is State.REFUSED
    assert isinstance(second.lab.error, InputError)
    assert "takes part in this test already: stop one of the two" in str(second.lab.error)
    assert second.left
    second.leave()
    virtual.play(bench, pause=lambda: bench.master.ticks > 100)
    assert bench.master.lab.running
    assert bench.slave.lab.running


def test_if_two_processes_register_as_one_slave_only_the_first_is_armed() -> None:
    chosen = without_recorder(TWO)
    bench = virtual.assemble(chosen, reality.as_planned(chosen), None)
    role, first = "slave.roof", bench.slaves["slave.roof"]
    second = build_slave(
        Setting(chosen, bench.endpoints[role], bench.slave.lab.clock), reality.as_planned(chosen).of(role)
    )
    request = Register(bench.master.lab.exchange.session, PROTOCOL_VERSION, chosen.digest())
    for slave in (first, second):
        slave.take(Received(request))
    virtual.play(bench, pause=lambda: bench.master.lab.exchange.state is State.REGISTERED)
    partner = bench.master.partners[role]
    while bench.endpoints["master"].receive() is not None:
        pass
    second.take(Received(Sync(request.session, 0, 0)))
    second.take(Received(Start(request.session, 1, 1)))
    assert bench.endpoints["master"].receive() is None  # a process that was not armed has nothing to say
    second.take(Received(Arm(request.session, partner.instance)))
    assert partner.instance == first._instance
    assert second.lab.exchange.state is State.REFUSED
    assert second.lab.exchange.session == 0


def test_the_shipped_plan_reduces_the_motion() -> None:
    chosen = with_test(plans.load(cli.plan_path("two_dampers")), duration=5.0)
    ground = substructure.ground_rows(chosen, substructure.motion(chosen))
    peaks = []
    for amd in (True, False):
        control = dataclasses.replace(chosen.control, amd=amd)
        found = simulate(chosen if amd else chosen.everywhere(control=control), ground)
        peaks.append(largest(found.master["displacement"]))
    assert peaks[0] < 0.85 * peaks[1]


def stray(**changes: Any) -> Received:
    """A message of a recorder outside the test."""
    return Received(Recorder(0, "failed", "", "stopped by the user", b"")._replace(**changes), "recorder")


def test_a_recorder_without_a_session_or_of_another_one_is_ignored(short_plan: Plan, tmp_path: Path) -> None:
    plan = short_plan.with_ticks(100)
    bench = virtual.assemble(plan, reality.as_planned(plan), tmp_path / "a.mcap")

    def strayed() -> str:
        for loop in bench.loops.values():
            if loop.lab.running:
                loop.take(stray())
                loop.take(stray(session=77))
        return ""

    assert virtual.run(bench, strayed) is None
    assert bench.master.lab.recorded
    assert bench.slave.lab.recorded


def test_a_late_recorder_is_invited_to_a_test_that_does_not_require_one(short_plan: Plan) -> None:
    plan = without_recorder(short_plan)
    bench = running(plan, 1)
    sent: list[object] = []
    bench.master.lab.endpoint.send = lambda message, to="": sent.append(message) or 0  # type: ignore[func-returns-value,method-assign]
    bench.master.take(Received(Recorder(0, "ready", plan.digest(), "", b""), "recorder"))
    bench.master.take(Received(Recorder(0, "ready", "another plan", "", b""), "recorder"))
    assert [type(message) for message in sent] == [Register]
