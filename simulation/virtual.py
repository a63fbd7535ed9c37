"""A whole test in virtual time: the real drive, loops, rigs and recorder in one process, over a link in memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from common.errors import InterlockError, RthsError
from common.lab.laboratory import Setting
from common.lab.preflight import Gate
from common.link.endpoint import Endpoint
from common.link.memory_link import MemoryHub
from common.plan.plan import Plan
from common.reality.reality import Reality
from common.reporting import Report, silent
from common.roles import MASTER, RECORDER
from common.terminal.telling import Tell, untold
from loop import substructure
from master.assembly import build_loop as build_master
from master.assembly import serve as serve_master
from master.building import BuildingStep
from master.loop import MasterLoop
from recorder import files
from recorder.loop import CONSEQUENCE, RecorderLoop
from recorder.sink import FileSink
from simulation.processes import driving, recording
from simulation.world import NO_DRIFT, Drift, World
from slave.assembly import build_loop as build_slave
from slave.loop import SlaveLoop

SESSION = (
    1  # constant, because the same test must give the same bits; no other test can be on the link in memory
)
NO_OPERATOR = "latched in its safe state, and in virtual time there is no operator to reset it."
SAME_CLOCK: Mapping[str, Drift] = {}


class VirtualTest(NamedTuple):
    """A test in virtual time: its world, the master, the slaves by role, and the recorder or None."""

    world: World
    master: MasterLoop
    slaves: dict[str, SlaveLoop]
    recorder: RecorderLoop | None
    endpoints: dict[str, Endpoint]
    gates: dict[str, Gate]  # of the pre-flight, for master and slaves by role; empty without a pre-flight

    @property
    def slave(self) -> SlaveLoop:
        """The only slave, or the first of several."""
        return next(iter(self.slaves.values()))

    @property
    def loops(self) -> dict[str, MasterLoop | SlaveLoop]:
        """The loops of master and slaves by role."""
        return {MASTER: self.master, **self.slaves}


def assemble(
    plan: Plan,
    reality: Reality,
    output: Path | None,
    report: Report = silent,
    *,
    gate: Gate | None = None,
    drifts: Mapping[str, Drift] = SAME_CLOCK,
    building: BuildingStep | None = None,
) -> VirtualTest:
    """Build all laboratories over a link in memory, and a recorder if `output` is given.

    With a `gate` the sensors of all rigs are judged when the rigs are armed, the slaves accept the same risks as the
    master, and the results and accepted risks are recorded; without one nothing is judged. `drifts` are the clocks, by
    role, that differ from the world's. With a `building` the master serves it instead of computing the plan's own.
    """
    world, hub = World(), MemoryHub(plan.roles)
    roles = (MASTER, *plan.roles) if output is None else (MASTER, *plan.roles, RECORDER)
    settings = {}
    for role in roles:
        process = world.process(role, drifts.get(role, NO_DRIFT))
        settings[role] = Setting(plan, hub.join(role, process), process, report)
    gates = {MASTER: gate} | {role: Gate(gate.accepted) for role in plan.roles} if gate else {}
    begin = build_master if building is None else partial(serve_master, building=building)
    master = begin(settings[MASTER], reality, session=SESSION, epoch_ns=0, gate=gate)
    slaves = {
        role: build_slave(settings[role], reality.of(role), gate=gates.get(role)) for role in plan.roles
    }
    recorder = begin_recording(settings[RECORDER], world, output) if output is not None else None
    endpoints = {role: setting.endpoint for role, setting in settings.items()}
    return VirtualTest(world, master, slaves, recorder, endpoints, gates)


def begin_recording(setting: Setting, world: World, output: Path) -> RecorderLoop:
    """Create the file and the recorder; the recorder's process begins at time 0."""
    file = files.begin(output, setting.plan, substructure.recorded_ground(setting.plan))
    recorder = RecorderLoop(setting, FileSink(file, setting.clock, timely=False))
    process = world.process(RECORDER)
    process.start(recording(recorder, setting.endpoint, process, file))
    return recorder


def run(bench: VirtualTest, stopping: Callable[[], str], tell: Tell = untold) -> RthsError | None:
    """Run a test to its end; returns the error that ended it, or None if it was completed.

    If several laboratories end with an error, the cause is returned and not its consequences; of several causes the
    master's.
    """
    codes = _listening(bench, tell)
    play(bench, stopping)
    failed = {role: loop.lab.error for role, loop in bench.loops.items() if loop.lab.error}
    causes = [error for role, error in failed.items() if codes.get(role) != CONSEQUENCE]
    if not failed and not bench.master.completed:
        return InterlockError(bench.master.lab.exchange.cause or "The test never began.")
    incomplete = [bench.recorder.error] if bench.recorder is not None and bench.recorder.error else []
    return next(iter([*causes, *failed.values(), *incomplete]), None)


def play(
    bench: VirtualTest, stopping: Callable[[], str] = str, pause: Callable[[], bool] | None = None
) -> None:
    """Let time pass to the end of the test, or until `pause` returns true; the next call continues from there.

    `stopping` returns the reason to end the test early, empty while there is none. An exception of a process that is
    not an error of a test is raised here after all processes have ended.
    """
    for role, loop in bench.loops.items():
        process = bench.world.process(role)
        reason = stopping if role == MASTER else process.stopping
        if not process.started:
            process.start(driving(loop, _unattended(loop, reason), bench.gates.get(role)))
    bench.world.run(pause)
    for process in bench.world.processes.values():
        if process.error is not None:
            raise process.error


def _unattended(loop: MasterLoop | SlaveLoop, stopping: Callable[[], str]) -> Callable[[], str]:
    """The reason to stop of a laboratory without an operator: a latched one stops, because nobody can reset it.

    During the handshake `stopping` is not asked: it takes no time, and afterwards all laboratories hear of the end.
    """
    lab = loop.lab

    def reason() -> str:
        if lab.running:
            return stopping()
        return NO_OPERATOR if lab.safety.latched else ""

    return reason


def _listening(bench: VirtualTest, tell: Tell) -> dict[str, str]:
    """The code of the first error that each role reports from here on, by role; filled in as the test runs.

    The master's progress is passed on to `tell`.
    """
    codes: dict[str, str] = {}
    ticks = bench.master.lab.plan.ticks

    def listen(role: str, onward: Report) -> Report:
        def report(kind: str, data: Mapping[str, Any]) -> None:
            if kind == "event" and data["level"] == "error":
                codes.setdefault(role, data["code"])
            if kind == "progress" and role == MASTER:
                tell("ticks", data["tick"], ticks)
            onward(kind, data)

        return report

    for role, loop in bench.loops.items():
        loop.lab.report = listen(role, loop.lab.report)
    return codes
