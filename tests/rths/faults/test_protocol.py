"""The loops of both laboratories under messages in any order, of anybody, by Hypothesis' state machines.

The loops' own `take`, `poll` and `tick` run, without a link in between. A rule either does what the other laboratory
would do next, or sends what no laboratory would.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Any, get_type_hints

import hypothesis.strategies as st
from hypothesis import settings
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from common.lab.laboratory import Setting
from common.link.endpoint import Received
from common.plan.plan import PROTOCOL_VERSION, Plan
from common.plan.read import load, with_test
from common.protocol import messages
from common.protocol.codec import MESSAGES
from common.protocol.exchange import FINAL, TRANSITIONS, State
from common.protocol.messages import Message
from common.reality.reality import as_planned
from common.roles import MASTER, RECORDER, SLAVE
from common.terminal import cli
from master import assembly as master_assembly
from master.loop import MasterLoop
from simulation.world import World
from slave import assembly as slave_assembly
from slave.loop import SlaveLoop
from tests.helpers import without_recorder
from validation.faults.hostile import command, feedback
from validation.faults.invariants import drives
from validation.faults.lab import PROBED
from validation.faults.rigs import Probe

SESSION, OTHER = 5, 6
INSTANCE = 3
PLAN: Plan = without_recorder(with_test(load(cli.plan_path(None)), duration=2.0))
INTERVAL = 2_000_000

SESSIONS = st.sampled_from([0, SESSION, SESSION, OTHER])
NUMBERS = st.sampled_from([-1, 0, 1, 5, 100, 10**6, 2**31, 2**62]) | st.integers(-1, 1000)
STAMPS = st.integers(-(10**12), 10**12)
VALUES = st.floats(-1e6, 1e6) | st.floats(-0.01, 0.01)
TEXTS = st.sampled_from(["", "a text", SLAVE, MASTER, RECORDER, "ready", "failed", PLAN.digest()])
BYTES = st.sampled_from([b"", b"\x80", b"\x81\xa5slave\x01", b"garbage"])
FIELDS: dict[str, st.SearchStrategy[Any]] = {"session": SESSIONS, "instance": st.sampled_from([1, INSTANCE])}
TYPES: dict[Any, st.SearchStrategy[Any]] = {
    tuple[float, ...]: st.tuples(*[VALUES] * 4),
    float: VALUES,
    str: TEXTS,
    bytes: BYTES,
    int: NUMBERS,
}


def any_of(kind: Any) -> st.SearchStrategy[Message]:
    """Messages of a kind with any fields that the codec accepts."""
    given = {
        name: FIELDS.get(name, STAMPS if name.endswith("_ns") else TYPES[hint])
        for name, hint in get_type_hints(kind).items()
    }
    return st.builds(kind, **given)


ANYTHING = st.one_of([any_of(kind) for kind in MESSAGES])


class Sent:
    """An endpoint that keeps what is sent."""

    def __init__(self) -> None:
        self.messages: list[Message] = []

    def enter(self, session: int) -> None:
        """No key."""

    def expect(self, measured: Any) -> None:
        """No frame is decoded."""

    def send(self, message: Message, to: str = "") -> int:
        self.messages.append(message)
        return 0

    def receive(self, timeout: float = 0.0) -> Received | None:
        return None

    def news(self, now_ns: int) -> dict[str, Any] | None:
        return None

    def close(self) -> None:
        """Nothing to leave."""


class Laboratory(RuleBasedStateMachine):
    """The rules and invariants that both laboratories share."""

    role = ""
    loop: MasterLoop | SlaveLoop
    probe: Probe

    def __init__(self) -> None:
        super().__init__()
        self.world = World(2**62)
        self.process = self.world.process(self.role)
        self.world.time = 10**9
        self.endpoint = Sent()
        self.tick = 0
        self.past: deque[tuple[Message, str]] = deque(maxlen=20)
        self.state = State.IDLE

    def setting(self) -> Setting:
        return Setting(PLAN, self.endpoint, self.process)

    def give(self, message: Message, role: str) -> None:
        """One message for the loop."""
        self.past.append((message, role))
        now = self.process.now()
        self.loop.take(Received(message, role, now, now))

    def step(self, late: float = 0.0) -> None:
        """The next tick at its time, or late by some intervals; none where ticks may not go on."""
        if not self.loop.lab.running or self.tick >= PLAN.ticks:
            return
        due = self.loop.lab.tick_ns(self.tick) + round(late * INTERVAL)
        self.process.ahead = 0
        self.world.time = max(self.world.time, min(due, self.world.time + 10**9))
        self.loop.tick(self.tick)
        self.tick += 1

    @rule(message=ANYTHING, role=st.sampled_from([MASTER, SLAVE, RECORDER, "stranger"]))
    def anything(self, message: Message, role: str) -> None:
        self.give(message, role)

    @rule()
    def again(self) -> None:
        if self.past:
            self.give(*self.past[0])

    @rule(seconds=st.sampled_from([0.001, 0.05, 0.2, 2.0]))
    def time_passes(self, seconds: float) -> None:
        self.world.time += round(seconds * 1e9)
        if not self.loop.lab.running:
            self.loop.poll()

    @rule(reason=st.just("stopped by the user (SIGINT)."))
    def somebody_stops(self, reason: str) -> None:
        self.loop.stop(reason)

    @invariant()
    def commands_stay_within_limits(self) -> None:
        for told in self.probe.log.commands[-2:]:
            for value, drive in zip(told, drives(PLAN, self.role), strict=True):
                assert math.isfinite(value)
                assert abs(value) <= drive.most

    @invariant()
    def states_follow_the_table(self) -> None:
        state = self.loop.lab.exchange.state
        assert state in reachable(self.state)
        self.state = state

    @invariant()
    def an_early_end_has_an_error(self) -> None:
        lab = self.loop.lab
        assert (lab.error is not None) == (lab.exchange.state in (State.TRIPPED, State.LOST, State.REFUSED))


def reachable(state: State) -> set[State]:
    """The states that are reachable from a state by any number of events."""
    found, left = {state}, [state]
    while left:
        for target in TRANSITIONS[left.pop()].values():
            if target not in found:
                found.add(target)
                left.append(target)
    assert state not in FINAL or found == {state}
    return found


class SlaveMachine(Laboratory):
    """A slave whose master mostly follows the protocol."""

    role = SLAVE

    def __init__(self) -> None:
        super().__init__()
        real = as_planned(PLAN)
        self.probe = Probe(slave_assembly.build_rig(real), self.process)
        probed = replace(real, slave=replace(PROBED, options={"probe": self.probe}))
        self.loop = slave_assembly.build_loop(self.setting(), probed, instance=INSTANCE)
        self.probe.loop = self.loop
        self.seq = -1

    @rule()
    def handshake(self) -> None:
        state = self.loop.lab.exchange.state
        follows: dict[State, Message] = {
            State.IDLE: messages.Register(SESSION, PROTOCOL_VERSION, PLAN.digest()),
            State.REGISTERED: messages.Arm(SESSION, INSTANCE),
            State.ARMED: messages.Start(SESSION, self.process.now() + 10**8, 0),
        }
        if state in follows:
            self.give(follows[state], MASTER)

    @initialize(far=st.booleans())
    def begin(self, far: bool) -> None:
        for _ in range(3 * far):
            self.handshake()

    @rule(count=st.integers(1, 5), value=st.floats(-0.02, 0.02), late=st.sampled_from([0.0, 0.0, 0.5, 1.5]))
    def ticks_with_commands(self, count: int, value: float, late: float) -> None:
        for _ in range(count):
            self.seq = self.tick
            self.give(command(SESSION, self.seq, value, value), MASTER)
            self.step(late)

    @rule(count=st.integers(1, 12))
    def ticks_without(self, count: int) -> None:
        for _ in range(count):
            self.step()

    @invariant()
    def answers_name_newer_and_newer_commands(self) -> None:
        used = [one.command_seq for one in self.endpoint.messages if isinstance(one, messages.Feedback)]
        assert used == sorted(used)


class MasterMachine(Laboratory):
    """A master whose slave mostly follows the protocol."""

    role = MASTER

    def __init__(self) -> None:
        super().__init__()
        real = as_planned(PLAN)
        self.probe = Probe(master_assembly.build_rig(real), self.process)
        probed = replace(real, master=replace(PROBED, options={"probe": self.probe}))
        self.loop = master_assembly.build_loop(self.setting(), probed, session=SESSION, epoch_ns=0)
        self.probe.loop = self.loop
        self.probe.partners = list(self.loop.partners.values())

    @rule()
    def handshake(self) -> None:
        """The slave's answer to the last request."""
        self.loop.poll()
        asked = self.endpoint.messages[-1] if self.endpoint.messages else None
        now = self.process.now()
        match asked:
            case messages.Register():
                self.give(messages.Registered(SESSION, INSTANCE), SLAVE)
            case messages.Arm():
                self.give(messages.Armed(SESSION), SLAVE)
            case messages.Sync():
                self.give(messages.SyncReply(SESSION, asked.seq, now, now), SLAVE)
            case messages.Start():
                self.give(messages.Scheduled(SESSION), SLAVE)
            case _:
                pass
        self.world.time += 200_000

    @initialize(steps=st.sampled_from([0, 2, 210]))
    def begin(self, steps: int) -> None:
        for _ in range(steps):
            self.handshake()

    @rule(count=st.integers(1, 5), force=st.floats(-100.0, 100.0), late=st.sampled_from([0.0, 0.0, 0.5, 1.5]))
    def ticks_with_feedback(self, count: int, force: float, late: float) -> None:
        for _ in range(count):
            self.step(late)
            seq = self.tick - 1
            self.give(feedback(SESSION, seq, 0.0, 0.0, 0.0, force), SLAVE)

    @rule(count=st.integers(1, 12))
    def ticks_without(self, count: int) -> None:
        for _ in range(count):
            self.step()

    @invariant()
    def feedbacks_in_use_are_newer_and_newer(self) -> None:
        used = [row[0] for row in self.probe.log.used]
        assert used == sorted(used)


def test_an_arm_for_another_process_does_not_crash_a_slave() -> None:
    slave = SlaveMachine()
    slave.begin(far=True)
    slave.step()
    assert slave.loop.lab.exchange.state is State.RUNNING
    slave.give(messages.Arm(SESSION, INSTANCE + 1), MASTER)


SHORT = settings(max_examples=60, stateful_step_count=25)
TestSlave = SlaveMachine.TestCase
TestSlave.settings = SHORT
TestMaster = MasterMachine.TestCase
TestMaster.settings = SHORT
