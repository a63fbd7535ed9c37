"""An armed test that waits for an operator's start, in virtual time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from common.errors import LostError
from common.lab.preflight import Gate
from common.link.endpoint import Received
from common.plan.plan import Plan
from common.plan.read import load, with_test
from common.protocol.exchange import State
from common.protocol.messages import Answer, Operator
from common.reality import reality
from common.recording.reader import read
from master import handshake, loop
from simulation import virtual
from simulation.virtual import VirtualTest
from tests.helpers import ROOT

WAIT_S = 45.0  # longer than `connect_timeout`: waiting for an operator is no silence


class Bench:
    """A test whose operator presses at a time of the world, in s; `answers` are those of the laboratories."""

    def __init__(self, plan: Plan, path: Path | None, presses: dict[float, str]) -> None:
        self.bench: VirtualTest = virtual.assemble(
            plan, reality.as_planned(plan), path, gate=Gate(await_start=True)
        )
        self.answers: dict[float, dict[str, Answer]] = {at: {} for at in presses}
        self._newest: list[Answer] = []
        for role, each in self.bench.loops.items():
            self._attend(role, each, plan, dict(presses))
        self.error = virtual.run(self.bench, str)

    def _attend(self, role: str, lab: Any, plan: Plan, presses: dict[float, str]) -> None:
        poll, send = lab.poll, lab.lab.endpoint.send

        def polled() -> None:
            now = self.bench.world.time * 1e-9
            for at in [at for at in presses if now >= at]:
                wish = Operator(0, plan.digest(), presses.pop(at), round(at * 1e7) + 1, "ready")
                lab.take(Received(wish, "operator", self.bench.world.time))
                self.answers[at] |= {role: self._newest.pop()} if self._newest else {}
            poll()

        def sent(message: Any, to: str = "") -> Any:
            if isinstance(message, Answer):
                self._newest.append(message)
            return send(message, to)

        lab.poll, lab.lab.endpoint.send = polled, sent


@pytest.fixture
def brief(default_plan: Plan) -> Plan:
    return with_test(default_plan, duration=0.2)


def test_nothing_moves_before_the_operators_start_and_the_readings_are_the_same(
    brief: Plan, tmp_path: Path
) -> None:
    plain = virtual.assemble(brief, reality.as_planned(brief), tmp_path / "plain.mcap", gate=Gate())
    assert virtual.run(plain, str) is None
    late = Bench(brief, tmp_path / "late.mcap", {WAIT_S: "start"})
    assert late.error is None
    assert late.bench.master.lab.start_ns > WAIT_S * 1e9
    assert [(role, bool(one.accepted)) for role, one in late.answers[WAIT_S].items()] == [("master", True)]
    one, other = read(tmp_path / "plain.mcap"), read(tmp_path / "late.mcap")
    for topic in ("master", "slave"):
        for name in ("column_force", "damper_force", "table_command"):
            if name in one.columns[topic]:
                assert (one.columns[topic][name] == other.columns[topic][name]).all()
    said = [event for event in other.events if event["code"] == "operator"]
    assert [(event["lab"], event["text"]) for event in said] == [
        ("master", "start (ready): The test begins.")
    ]


def test_a_start_is_accepted_once_and_only_by_a_test_that_waits_for_it(brief: Plan, tmp_path: Path) -> None:
    early = Bench(brief, tmp_path / "a.mcap", {0.0: "start", 4.9999999: "start", 5.0: "start"})
    assert early.error is None
    assert not early.answers[0.0]["master"].accepted
    assert "does not wait for a start: the laboratory is idle" in early.answers[0.0]["master"].text
    assert early.answers[4.9999999]["master"].accepted
    assert not early.answers[5.0]["master"].accepted


@pytest.mark.parametrize("word", ["stop", "emergency"])
def test_an_armed_test_can_be_stopped(word: str, brief: Plan, tmp_path: Path) -> None:
    ended = Bench(brief, tmp_path / "a.mcap", {5.0: word})
    assert "by the operator: ready" in str(ended.error)
    assert ended.answers[5.0]["master"].accepted
    assert not ended.bench.master.ticks


def test_rigs_are_disarmed_where_no_start_comes(
    brief: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (handshake, loop):
        monkeypatch.setattr(module, "START_S", 20.0)
    forgotten = Bench(brief, tmp_path / "a.mcap", {})
    assert "No operator started the armed test within 20 s." in str(forgotten.error)
    assert 20.0 < forgotten.bench.world.time * 1e-9 < 60.0
    assert not forgotten.bench.master.ticks


def test_a_slave_that_falls_silent_while_the_rigs_wait_ends_the_test(brief: Plan, tmp_path: Path) -> None:
    bench = virtual.assemble(
        brief, reality.as_planned(brief), tmp_path / "a.mcap", gate=Gate(await_start=True)
    )
    slave = bench.slave
    poll, send = slave.poll, slave.lab.endpoint.send

    def polled() -> None:
        if bench.world.time > 5e9:
            slave.lab.endpoint.send = lambda message, to="": 0  # type: ignore[method-assign]
        poll()

    slave.poll = polled  # type: ignore[method-assign]
    error = virtual.run(bench, str)
    slave.lab.endpoint.send = send  # type: ignore[method-assign]
    assert isinstance(error, LostError)
    assert "slave has been silent for 1 s" in str(error)


def test_a_test_without_slaves_also_waits_for_the_start(tmp_path: Path) -> None:
    plan = with_test(load(ROOT / "rths/plans/single_site.toml"), duration=0.2)
    late = Bench(plan, tmp_path / "a.mcap", {WAIT_S: "start"})
    assert late.error is None
    assert late.bench.master.lab.exchange.state is State.DONE
    assert late.bench.master.lab.start_ns > WAIT_S * 1e9
