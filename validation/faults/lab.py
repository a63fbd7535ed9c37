"""A whole test on simulated machines: the real loops, drive, endpoints and codec on one world's time."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from common.lab.drive import longest_leave
from common.lab.laboratory import Setting
from common.plan.laboratory_tables import RigTable
from common.plan.plan import Plan
from common.reality.reality import Reality
from common.reporting import Report
from common.roles import MASTER, RECORDER
from loop import substructure
from master import assembly as master_assembly
from master.loop import MasterLoop
from recorder import files
from recorder.loop import RecorderLoop
from recorder.sink import FileSink
from simulation.processes import driving, recording
from simulation.world import Drift, Process, World
from slave import assembly as slave_assembly
from slave.loop import SlaveLoop
from validation.faults.rigs import Probe, ProbedRig
from validation.faults.wire import CABLE, Conditions, Port, Wire, WireEndpoint

SESSION = 1  # always the same, so that the same test gives the same bits
PROBED = RigTable(class_=f"{ProbedRig.__module__}:{ProbedRig.__name__}")
# Ns after the others, so that they hear its first message: many times the link's delay.
MASTER_STARTS = 1_000_000


class Surrounding(NamedTuple):
    """Surroundings of a test: the seed of the link's draws, its undisturbed condition, the clocks, a recording."""

    seed: int = 0
    base: Conditions = CABLE
    drifts: Mapping[str, Drift] = {}
    recording: Path | None = None


CALM = Surrounding()


class Told(NamedTuple):
    """An event that a laboratory reported, and when (world time, ns)."""

    time: int
    data: Mapping[str, Any]


class Simulation:
    """Master, slaves and, where there is a recording, a recorder; `run` plays the test to its end."""

    def __init__(self, plan: Plan, reality: Reality, surrounding: Surrounding = CALM) -> None:
        self.plan = plan
        self.recording = surrounding.recording
        timeout = plan.link.connect_timeout + plan.link.loss_timeout + plan.test.duration
        self.world = World(round((timeout + 3.0 * longest_leave(plan)) * 1e9))
        self.wire = Wire(self.world, plan.roles, surrounding.base, surrounding.seed)
        self.events: dict[str, list[Told]] = {}
        self.ports: dict[str, Port] = {}
        self.endpoints: dict[str, WireEndpoint] = {}
        self.probes: dict[str, Probe] = {}
        self.loops: dict[str, MasterLoop | SlaveLoop] = {}
        self.recorder: RecorderLoop | None = None
        self.strangers: set[str] = set()  # roles that heard frames of a stranger who has the keys
        self._drifts = surrounding.drifts
        for place, role in enumerate(plan.roles):
            self._add_slave(role, reality, place)
        self._add_master(reality)
        if self.recording is not None:
            self._add_recorder(self.recording)

    # -- assembly ---------------------------------------------------------------------------------

    def _process(self, role: str) -> tuple[Process, Setting]:
        process = self.world.process(role, self._drifts.get(role, Drift()))
        port = self.ports[role] = self.wire.join(process)
        endpoint = self.endpoints[role] = WireEndpoint(port, self.plan.digest())
        return process, Setting(self.plan, endpoint, process, self._listening(role, process))

    def _listening(self, role: str, process: Process) -> Report:
        told = self.events.setdefault(role, [])

        def report(kind: str, data: Mapping[str, Any]) -> None:
            if kind == "event":
                told.append(Told(process.time, dict(data)))

        return report

    def _add_slave(self, role: str, reality: Reality, place: int) -> None:
        one = reality.of(role)
        process, setting = self._process(role)
        probe = Probe(slave_assembly.build_rig(one), process)
        probed = replace(one, slave=replace(PROBED, options={"probe": probe}))
        self._add(role, probe, slave_assembly.build_loop(setting, probed, instance=1 + place), 0)

    def _add_master(self, reality: Reality) -> None:
        process, setting = self._process(MASTER)
        probe = Probe(master_assembly.build_rig(reality), process)
        probed = replace(reality, master=replace(PROBED, options={"probe": probe}))
        loop = master_assembly.build_loop(setting, probed, session=SESSION, epoch_ns=0)
        self._add(MASTER, probe, loop, MASTER_STARTS)

    def _add(self, role: str, probe: Probe, loop: MasterLoop | SlaveLoop, at: int) -> None:
        process = probe.process
        probe.loop = loop
        probe.partners = list(getattr(loop, "partners", {}).values())
        self.probes[role] = probe
        self.loops[role] = loop
        rejected = self.endpoints[role].rejected
        process.start(driving(loop, process.stopping, rejected=rejected), at)

    def _add_recorder(self, path: Path) -> None:
        process, setting = self._process(RECORDER)
        file = files.begin(path, self.plan, substructure.recorded_ground(self.plan))
        loop = self.recorder = RecorderLoop(setting, FileSink(file, process))
        process.start(recording(loop, setting.endpoint, process, file))

    # -- course -----------------------------------------------------------------------------------

    def run(self) -> None:
        """Play the test to its end; the results are in probes, events, ports and the wire's ledgers."""
        self.world.run()

    def digest(self) -> str:
        """Sixteen hex digits of every command that reached a rig, and when."""
        found = hashlib.blake2b(digest_size=8)
        for role, probe in self.probes.items():
            found.update(role.encode())
            for time, command in zip(probe.log.times, probe.log.commands, strict=True):
                found.update(struct.pack(f"<q{len(command)}d", time, *command))
        return found.hexdigest()
