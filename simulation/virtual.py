"""A whole test in virtual time: the real loops and rigs in one process over a link in memory."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from common.errors import InterlockError, RthsError
from common.host.clock import VirtualClock
from common.lab.laboratory import Report, Setting, silent
from common.lab.preflight import Gate
from common.link.endpoint import Endpoint
from common.link.memory_link import MemoryHub
from common.plan.plan import Plan
from common.plan.reality import Reality, as_planned
from common.plan.tables import Rig, Sensors
from common.recording.reader import Run, read
from common.roles import MASTER, RECORDER
from common.safety.modes import Mode
from common.terminal.telling import Tell, untold
from master.assembly import build_loop as build_master
from master.loop import MasterLoop
from models.loop import substructure
from recorder import files
from recorder.loop import CONSEQUENCE, RecorderLoop
from recorder.sink import FileSink
from slave.assembly import build_loop as build_slave
from slave.loop import SlaveLoop

SESSION = 1  # virtual time knows one test only, and the same test gives the same bits
ROUND_NS = 1_000_000
MOST_ROUNDS = 20_000


class Bench(NamedTuple):
    """A test in memory: clock, master, slaves by role, and the recorder where there is one."""

    clock: VirtualClock
    master: MasterLoop
    slaves: dict[str, SlaveLoop]
    recorder: RecorderLoop | None
    endpoints: dict[str, Endpoint]
    gates: dict[str, Gate]  # of master and slaves by role, where they must pass one

    @property
    def slave(self) -> SlaveLoop:
        """The slave, of several the first."""
        return next(iter(self.slaves.values()))

    @property
    def loops(self) -> dict[str, MasterLoop | SlaveLoop]:
        """Master and slaves by role."""
        return {MASTER: self.master, **self.slaves}


def assemble(
    plan: Plan,
    reality: Reality,
    output: Path | None,
    report: Report = silent,
    *,
    gate: Gate | None = None,
) -> Bench:
    """All laboratories over a link in memory, recording into `output` where one is given.

    With a master's `gate` all sensors are judged as the rigs are armed, the slaves' with the same risks accepted, and
    the recording is told what was passed and overruled; without one nothing is judged.
    """
    clock = VirtualClock()
    hub = MemoryHub(clock, plan.roles)
    roles = (MASTER, *plan.roles) if output is None else (MASTER, *plan.roles, RECORDER)
    endpoints: dict[str, Endpoint] = {role: hub.join(role) for role in roles}
    gates = {MASTER: gate} | {role: Gate(gate.accepted) for role in plan.roles} if gate else {}
    master = build_master(
        Setting(plan, endpoints["master"], clock, report),
        reality,
        session=SESSION,
        epoch_ns=0,
        gate=gate,
    )
    slaves = {
        role: build_slave(
            Setting(plan, endpoints[role], clock, report), reality.of(role), gate=gates.get(role)
        )
        for role in plan.roles
    }
    recorder = None
    if output is not None:
        motion = substructure.motion(plan)
        recording = files.begin(output, plan, motion, substructure.ground_rows(plan, motion))
        recorder = RecorderLoop(
            Setting(plan, endpoints["recorder"], clock, report), FileSink(recording, clock)
        )
    return Bench(clock, master, slaves, recorder, endpoints, gates)


def run(bench: Bench, stopping: Callable[[], str], tell: Tell = untold) -> RthsError | None:
    """Play a test to its end; the error that ended it, None where it was completed.

    Where several laboratories end with one, that which follows another's is not the one: the cause counts, and of
    several causes the master's.
    """
    codes = _listening(bench)
    rounds, most = 0, MOST_ROUNDS + bench.master.lab.plan.preflight.exchanges
    while not bench.master.lab.running and not _over(bench) and rounds < most:
        bench.clock.time += ROUND_NS
        _exchange(bench, poll=True)
        rounds += 1
    if bench.master.lab.running:
        for role, gate in bench.gates.items():
            gate.note(bench.loops[role].lab)
    ticks = bench.master.lab.plan.ticks
    for tick in range(ticks):
        tell("ticks", tick, ticks)
        if reason := stopping():
            bench.master.stop(reason)
        if not bench.master.lab.running:
            break
        _tick(bench, tick)
    else:
        bench.master.finish()
    _come_to_rest(bench)
    _leave(bench)
    failed = {role: loop.lab.error for role, loop in bench.loops.items() if loop.lab.error}
    causes = [error for role, error in failed.items() if codes.get(role) != CONSEQUENCE]
    if not failed and bench.master.ticks < ticks:
        return InterlockError(bench.master.lab.exchange.cause or "The test never began.")
    incomplete = [bench.recorder.error] if bench.recorder is not None and bench.recorder.error else []
    return next(iter([*causes, *failed.values(), *incomplete]), None)


def _listening(bench: Bench) -> dict[str, str]:
    """Codes of the errors that end the laboratories' tests from now on, by role, as they are reported."""
    codes: dict[str, str] = {}

    def listen(role: str, onward: Report) -> Report:
        def report(kind: str, data: Mapping[str, Any]) -> None:
            if kind == "event" and data["level"] == "error":
                codes.setdefault(role, data["code"])
            onward(kind, data)

        return report

    for role, loop in bench.loops.items():
        loop.lab.report = listen(role, loop.lab.report)
    return codes


def simulated(
    plan: Plan, output: Path | None = None, *, noise: bool = False, tell: Tell = untold
) -> tuple[Run, RthsError | None]:
    """The nominal models of a plan with several slaves, played as a test: its recording, and what ended it early.

    The loop objects stand in for the compiled rollout, which knows one slave. Without `noise` sensors are free of
    it; a rig that the plan names has no part in a simulation.
    """
    sensors = plan.sensors if noise else Sensors(**dict.fromkeys(vars(plan.sensors), 0.0))
    nominal = replace(as_planned(plan), plan=replace(plan, sensors=sensors), master=Rig())
    nominal = replace(nominal, slaves=dict.fromkeys(nominal.slaves, Rig()))
    with tempfile.TemporaryDirectory() as folder:
        path = output or Path(folder) / "simulation.mcap"
        error = run(assemble(plan, nominal, path), str, tell)
        return read(path), error


def _tick(bench: Bench, tick: int) -> None:
    master, slaves = bench.master, bench.slaves.items()
    bench.clock.sleep_until(master.lab.tick_ns(tick))
    _drain(bench, "master", master)
    if not master.lab.running:
        return
    master.tick(tick)
    for role, slave in slaves:
        _drain(bench, role, slave)
        if slave.lab.running:
            slave.tick(tick)
    if bench.recorder is not None:
        master.lab.send_samples()
        for _, slave in slaves:
            slave.lab.send_samples()
        _record(bench)


def _come_to_rest(bench: Bench) -> None:
    """The ramps of all laboratories, an interval at a time."""
    lab = bench.master.lab
    tick = lab.tick_at(bench.clock.now() - lab.start_ns) + 1  # after the one that has been
    while True:
        bench.clock.sleep_until(bench.master.lab.tick_ns(tick))
        _exchange(bench, poll=False)
        loops = [loop for loop in bench.loops.values() if loop.lab.safety.mode is Mode.RAMPING]
        if not loops:
            return
        for loop in loops:
            loop.ease(tick)
            loop.tell()
            loop.lab.send_samples()
        tick += 1


def _exchange(bench: Bench, *, poll: bool) -> None:
    for role, loop in bench.loops.items():
        if poll:
            loop.poll()
        _drain(bench, role, loop)
    _record(bench)


def _drain(bench: Bench, role: str, loop: MasterLoop | SlaveLoop) -> None:
    endpoint = bench.endpoints[role]
    while (received := endpoint.receive()) is not None:
        loop.take(received)


def _record(bench: Bench) -> None:
    if bench.recorder is None:
        return
    endpoint = bench.endpoints["recorder"]
    while (received := endpoint.receive()) is not None:
        bench.recorder.take(received.message, received.received_ns)
    bench.recorder.poll()


def _leave(bench: Bench) -> None:
    bench.clock.sleep_until(bench.master.lab.tick_ns(bench.master.ticks))
    _exchange(bench, poll=False)
    loops = bench.loops.values()
    for loop in loops:
        loop.disarm()
    for _ in range(MOST_ROUNDS):
        if all(loop.left for loop in loops) and (bench.recorder is None or bench.recorder.done):
            break
        bench.clock.time += 50 * ROUND_NS
        for loop in loops:
            loop.leave()
        _exchange(bench, poll=False)
    if bench.recorder is not None:
        bench.recorder.close()


def _over(bench: Bench) -> bool:
    return any(loop.lab.exchange.ended for loop in bench.loops.values())
