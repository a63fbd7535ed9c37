"""A whole test in virtual time: the real loops and rigs in one process over a link in memory."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from common.clock import VirtualClock
from common.endpoint import Endpoint
from common.errors import RthsError
from common.laboratory import Report, Setting, silent
from common.links import link_model
from common.memory_link import MemoryHub
from common.plan import Plan
from common.reality import Reality
from master.assembly import build_loop as build_master
from master.loop import MasterLoop
from models import substructure
from recorder import files
from recorder.loop import RecorderLoop
from recorder.sink import FileSink
from slave.assembly import build_loop as build_slave
from slave.loop import SlaveLoop

SESSION = 1  # virtual time knows one test only, and the same test gives the same bits
ROUND_NS = 1_000_000
MOST_ROUNDS = 20_000


class Bench(NamedTuple):
    """A test in memory: clock, both laboratories, and the recorder where there is one."""

    clock: VirtualClock
    master: MasterLoop
    slave: SlaveLoop
    recorder: RecorderLoop | None
    endpoints: dict[str, Endpoint]


def assemble(plan: Plan, reality: Reality, output: Path | None, report: Report = silent) -> Bench:
    """Both laboratories over a link in memory, recording into `output` where one is given."""
    clock = VirtualClock()
    hub = MemoryHub(clock)
    roles = ("master", "slave") if output is None else ("master", "slave", "recorder")
    endpoints: dict[str, Endpoint] = {role: hub.join(role) for role in roles}
    master = build_master(
        Setting(plan, endpoints["master"], clock, report),
        reality,
        link_model(reality),
        session=SESSION,
        epoch_ns=0,
    )
    slave = build_slave(Setting(plan, endpoints["slave"], clock, report), reality, link_model(reality))
    recorder = None
    if output is not None:
        motion = substructure.motion(plan)
        recording = files.begin(output, plan, motion, substructure.ground_rows(plan, motion))
        recorder = RecorderLoop(
            Setting(plan, endpoints["recorder"], clock, report), FileSink(recording, clock)
        )
    return Bench(clock, master, slave, recorder, endpoints)


def run(bench: Bench, stopping: Callable[[], str]) -> RthsError | None:
    """Play a test to its end; the error that ended it, None where it was completed."""
    rounds = 0
    while not bench.master.lab.running and not _over(bench) and rounds < MOST_ROUNDS:
        bench.clock.time += ROUND_NS
        _exchange(bench, poll=True)
        rounds += 1
    ticks = bench.master.lab.plan.ticks
    for tick in range(ticks):
        if reason := stopping():
            bench.master.stop(reason)
        if not bench.master.lab.running:
            break
        _tick(bench, tick)
    else:
        bench.master.finish()
    _leave(bench)
    return bench.master.lab.error or bench.slave.lab.error


def _tick(bench: Bench, tick: int) -> None:
    master, slave = bench.master, bench.slave
    bench.clock.sleep_until(master.lab.tick_ns(tick))
    _drain(bench, "master", master)
    if not master.lab.running:
        return
    master.tick(tick)
    _drain(bench, "slave", slave)
    if slave.lab.running:
        slave.tick(tick)
    if bench.recorder is not None:
        master.lab.send_samples()
        slave.lab.send_samples()
        _record(bench)


def _exchange(bench: Bench, *, poll: bool) -> None:
    for role, loop in (("master", bench.master), ("slave", bench.slave)):
        if poll:
            loop.poll()
        _drain(bench, role, loop)
    _record(bench)


def _drain(bench: Bench, role: str, loop: MasterLoop | SlaveLoop) -> None:
    endpoint = bench.endpoints[role]
    while (received := endpoint.receive()) is not None:
        loop.take(received.message, received.received_ns)


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
    bench.master.disarm()
    bench.slave.disarm()
    for _ in range(MOST_ROUNDS):
        if bench.master.left and bench.slave.left and (bench.recorder is None or bench.recorder.done):
            break
        bench.clock.time += 50 * ROUND_NS
        bench.master.leave()
        bench.slave.leave()
        _exchange(bench, poll=False)
    if bench.recorder is not None:
        bench.recorder.close()


def _over(bench: Bench) -> bool:
    return bench.master.lab.exchange.ended or bench.slave.lab.exchange.ended
