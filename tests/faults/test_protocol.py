"""Control messages that do not fit: F34 to F36."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from common.link.endpoint import CHANNELS, SPOKEN
from common.link.transport import CONTROL
from common.plan.plan import PROTOCOL_VERSION
from common.protocol import messages
from common.protocol.codec import MESSAGES
from common.protocol.exchange import State
from common.protocol.messages import Message
from common.roles import MASTER, RECORDER, SLAVE
from tests.faults.rows import passed
from tests.faults.simulated import AT, LOST, Course, Scene, same_commands
from tests.rths.faults import test_protocol as machines
from tests.rths.faults.test_protocol import INSTANCE, PLAN, SESSION, MasterMachine, SlaveMachine
from validation.faults.hostile import blank


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"protocol": PROTOCOL_VERSION + 1}, "speaks protocol"),
        ({"plan": "0123456789abcdef"}, "the plans differ"),
        ({"protocol": PROTOCOL_VERSION + 1, "plan": "0123456789abcdef"}, "speaks protocol"),
    ],
)
def test_f34_another_protocol_version_or_plan(tmp_path: Path, changes: dict[str, Any], part: str) -> None:
    scene = Scene(tmp_path, recorded=False)
    scene.change(
        SLAVE,
        lambda message: message._replace(**changes) if isinstance(message, messages.Register) else None,
        CONTROL,
    )
    simulation = scene.simulation
    simulation.run()
    for role in (MASTER, SLAVE):
        lab = simulation.loops[role].lab
        assert lab.exchange.state is State.REFUSED
        assert part in lab.exchange.cause
        assert simulation.world.processes[role].error is None
        assert simulation.probes[role].log.commands == []
    passed(
        "F34",
        "another version, another plan (its units too), both",
        "simulation: a relay changes the master's registration",
        "REFUSED, both laboratories; with both the version is named (ADR 0023)",
        None,
        0.0,
        f"no recording begins; the master says: “{simulation.loops[MASTER].lab.exchange.cause}”",
    )


def test_f35_a_repeated_start_a_lost_stop_and_an_early_stop(tmp_path: Path, undisturbed: Course) -> None:
    scene = Scene(tmp_path)
    early = messages.Stop(1, 0, "too early.")
    route = scene.route(SLAVE, CONTROL)
    scene.simulation.world.at(0, route.put, [frame_of(scene, early)])
    for tick in (-50, 0, AT):  # the start is agreed 125 ticks before the first
        scene.at(tick, replay_start, scene)
    scene.impair(scene.plan.ticks - 20, 120, LOST, SLAVE, channel=CONTROL)
    course = scene.play()
    course.calm()
    assert same_commands(course, undisturbed)
    assert scene.simulation.endpoints[SLAVE].rejected == {"unregistered": 1}  # which no test's recording has
    lost = route.ledger.counts["Stop"]["lost"]
    assert lost >= 2
    assert all(loop.lab.exchange.state is State.DONE for loop in scene.simulation.loops.values())

    scene = Scene(tmp_path)
    scene.impair(AT - 1, 10_000, LOST, SLAVE, channel=CONTROL)
    scene.at(AT, scene.simulation.world.processes[MASTER].stop, "stopped by the user (SIGINT).")
    stopped = scene.play()
    assert stopped.code(SLAVE) == "watchdog"
    assert stopped.modes(SLAVE) == ["running", "holding", "ramping", "safe"]
    since = stopped.since(SLAVE)
    seconds = stopped.seconds_to(SLAVE, "ramping", since)
    assert seconds <= (stopped.plan.safety.ramp_after + 1) * stopped.plan.test.interval
    motion = stopped.motion(SLAVE, AT - 1)
    passed(
        "F35",
        "START again, STOP lost, STOP in IDLE",
        "simulation: the control route loses all, repeats the start, and brings a stop before any session",
        "RUNNING, then DONE; where every STOP is lost in the middle of the test SAFE",
        seconds,
        motion,
        f"at the end STOP is sent every 50 ms until it is heard ({lost} lost); "
        "in the middle the event watchdog in the slave; "
        "the early one is rejected as unregistered",
    )


def frame_of(scene: Scene, message: Message) -> Any:
    """A control message of an old session as a frame."""
    from common.protocol import codec
    from validation.faults.wire import Letter

    key = codec.session_key(message.session, scene.plan.digest())
    return Letter(codec.encode(message, key), type(message).__name__, -1, 0, "injected", intact=False)


def replay_start(scene: Scene) -> None:
    """Replays the master's own start message."""
    route = scene.route(SLAVE, CONTROL)
    route.put([one._replace(origin="replayed") for one in route.history if one.kind == "Start"])


# -- every message in every state -----------------------------------------------------------------

CONTROLS = [kind for kind in MESSAGES if kind not in CHANNELS]
WAY: list[State] = [State.IDLE, State.REGISTERED, State.ARMED, State.SCHEDULED, State.RUNNING]
ENDS = [State.STOPPING, State.DONE, State.TRIPPED, State.LOST]
BEGUN = [*WAY[1:], State.STOPPING]

EXPECTED: dict[str, dict[tuple[State, type], State]] = {
    SLAVE: {
        (State.IDLE, messages.Register): State.REGISTERED,
        (State.REGISTERED, messages.Arm): State.ARMED,
        (State.ARMED, messages.Start): State.SCHEDULED,
        **{(state, messages.Stop): State.STOPPING for state in WAY[1:]},
        **{(state, messages.Trip): State.TRIPPED for state in BEGUN},
    },
    MASTER: {
        (State.IDLE, messages.Registered): State.REGISTERED,
        (State.REGISTERED, messages.Armed): State.ARMED,
        (State.IDLE, messages.Refused): State.REFUSED,
        (State.REGISTERED, messages.Refused): State.TRIPPED,
        **{(state, messages.Trip): State.TRIPPED for state in (State.IDLE, *BEGUN)},
    },
}


def slave_in(state: State) -> SlaveMachine:
    """A slave that has come to a state."""
    machine = SlaveMachine()
    machine.begin(far=False)
    for _ in range(WAY.index(state) if state in WAY[:4] else 3):
        machine.handshake()
    if state not in WAY[:4]:
        machine.step()
    finish(machine, state, messages.Stop(SESSION, 1, "enough."), MASTER)
    return machine


def master_in(state: State) -> MasterMachine:
    """A master that has come to a state."""
    machine = MasterMachine()
    steps = {State.IDLE: 0, State.REGISTERED: 1, State.ARMED: 2}.get(state, 300)
    for _ in range(steps):
        if machine.loop.lab.exchange.state is not State.SCHEDULED:
            machine.handshake()
    if state not in WAY[:4]:
        machine.step()
    finish(machine, state, None, SLAVE)
    return machine


def finish(machine: SlaveMachine | MasterMachine, state: State, stop: Message | None, other: str) -> None:
    """Brings a laboratory to one of the final states."""
    loop = machine.loop
    if state in (State.STOPPING, State.DONE):
        if stop is not None:
            machine.give(stop, other)
        else:
            machine.loop.end("enough.")
    if state is State.DONE:
        if stop is None:
            machine.give(messages.Stopped(SESSION, 1), other)
        machine.world.time += 10**9
        loop.leave()
    if state is State.TRIPPED:
        machine.give(messages.Trip(SESSION, other, "tripped", "a limit."), other)
    if state is State.LOST:
        loop.lab.lost("The other one", 1.0)
    assert loop.lab.exchange.state is state


def message_of_kind(kind: type[Any], role: str) -> Message:
    """A message of a kind as the other laboratory of this test would send it."""
    fields: dict[str, Any] = {"session": SESSION, "lab": role, "plan": PLAN.digest()}
    fields |= {"protocol": PROTOCOL_VERSION, "instance": INSTANCE, "start_ns": 2 * 10**9, "seq": 0}
    known = {name: value for name, value in fields.items() if name in kind._fields}
    if kind is messages.Waiting:
        known["session"] = 0
    message: Message = kind(**blank(kind) | known)
    return message


@pytest.mark.slow
def test_f36_every_control_message_in_every_state() -> None:
    tried, changed = 0, set()
    for role, build, other in ((SLAVE, slave_in, MASTER), (MASTER, master_in, SLAVE)):
        for state in WAY + ENDS:
            for kind in CONTROLS:
                for sender in (other, RECORDER):
                    if kind not in SPOKEN[sender]:
                        continue  # rejected by the endpoint: kind_not_allowed
                    machine = build(state)
                    commands = list(machine.probe.log.commands)
                    wanted = EXPECTED[role].get((state, kind), state) if sender == other else state
                    message = message_of_kind(kind, sender)
                    for _ in range(2):  # what is expected once changes nothing the second time
                        machine.give(message, sender)
                        found = machine.loop.lab.exchange.state
                        assert found is wanted, (role, state, kind, sender, found)
                    assert machine.probe.log.commands == commands
                    tried += 1
                    if wanted is not state:
                        changed.add((role, state, kind))
    assert len(changed) == sum(map(len, EXPECTED.values()))
    assert machines.PLAN is PLAN
    passed(
        "F36",
        "every control message in every state",
        f"without a link: {tried} messages of either laboratory and the recorder, each twice",
        "the state they came in, but for the message that it waits for, STOP and TRIP",
        None,
        0.0,
        "no command reaches a rig; there is no negative acknowledgement (ADR 0023)",
    )
