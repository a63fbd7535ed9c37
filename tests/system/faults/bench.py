"""A test of the whole system whose processes are started apart, so that each can be hurt on its own; and what to ask
of its end.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self, TypeVar

from common.link.zenoh_link import listenable
from common.plan import read as plans
from common.plan.plan import Plan
from common.recording.reader import read
from common.recording.run import Run
from tests.processes import environment, tied
from tests.system.faults.rigs import Log, Wish

LABS = ("master", "slave")
LOST = ("watchdog", "lost")  # causes with exit code 4
INTERVAL = float(
    os.environ.get("RTHS_FAULT_INTERVAL", "0.01")
)  # s; a shared machine seldom pauses for five of it
WATCHDOG = 5 * INTERVAL  # W2
AT = 1.3  # s of test at which faults come: the building moves as much as it ever does
SPARE = 10_000  # entries of a rig's log beyond the ticks, for the ramp
ATTEMPTS = 5
REFUSED = 2  # exit code of what could not use a file, an option or a plan
STILL = 0.2  # s for which nothing must move
PAUSE = (
    0.9 * INTERVAL
)  # s that a command may be late; from there on a tick counts as the laboratory's own pause

PLAN = """
[test]
name = "fault"
duration = {duration}
interval = {interval}
[ground_motion]
scale = 0.3
[preflight]
exchanges = 200
{preflight}
[safety]
wait_for_reset = {stay}
{safety}
[master.rig]
class = "{rigs}:Column"
options = {{ log = "{folder}/master.log" }}
[slave.rig]
class = "{rigs}:Table"
options = {{ log = "{folder}/slave.log" }}
"""

T = TypeVar("T")


class DisturbedError(Exception):
    """This machine paused: something else than the fault has come first."""


def undisturbed(scenario: Callable[[Path], T], folder: Path) -> T:
    """What a scenario gives; repeated where this shared machine paused in it, which trips a laboratory by itself."""
    for attempt in range(ATTEMPTS):
        place = folder / str(attempt)
        place.mkdir()
        try:
            return scenario(place)
        except DisturbedError as reason:
            print(f"attempt {attempt + 1} was disturbed: {reason}")
            last = reason
    raise AssertionError(f"disturbed {ATTEMPTS} times, in the end: {last}")


class Process:
    """One process of a test: what it reports, and with which code it ends."""

    def __init__(self, module: str, *words: str | Path, before: Sequence[str] = ()) -> None:
        self.module = module
        self.said: list[tuple[float, dict[str, Any]]] = []
        self._errors: list[str] = []
        self._popen = subprocess.Popen(
            tied(*before, sys.executable, "-m", module, *words),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment(),
        )
        self.pid = self._popen.pid
        self._readers = [
            threading.Thread(target=self._listen, daemon=True),
            threading.Thread(target=self._complain, daemon=True),
        ]
        for reader in self._readers:
            reader.start()

    def _listen(self) -> None:
        for line in self._popen.stdout or ():
            if line.startswith("{"):
                self.said.append((time.monotonic(), json.loads(line)))

    def _complain(self) -> None:
        self._errors.extend(self._popen.stderr or ())

    @property
    def errors(self) -> str:
        """What it wrote on standard error."""
        return "".join(self._errors)

    def events(self, code: str) -> list[dict[str, Any]]:
        """The events of a code that it reported, in order."""
        return [data for _, data in self.said if data["kind"] == "event" and data["code"] == code]

    @property
    def causes(self) -> list[dict[str, Any]]:
        """The events that ended the test before its end, the first cause first."""
        events = [data for _, data in self.said if data["kind"] == "event"]
        return [
            event
            for event in events
            if event["level"] == "error" or (event["code"] == "stop" and event["text"] != "completed")
        ]

    @property
    def modes(self) -> list[str]:
        """Its changes of the safety mode as it reported them, those before the agreed start left out."""
        return [event["text"] for event in self.events("mode")]

    def wait(self, found: Callable[[dict[str, Any]], bool], seconds: float = 30.0) -> float:
        """Until it has reported something; when it did, monotonic s."""
        deadline, seen = time.monotonic() + seconds, 0
        while True:
            while seen < len(self.said):
                at, data = self.said[seen]
                if found(data):
                    return at
                seen += 1
            if time.monotonic() > deadline or (self._popen.poll() is not None and seen == len(self.said)):
                told = [data for _, data in self.said if data["kind"] != "progress"][-8:]
                raise DisturbedError(f"{self.module} never said what was waited for: {told} {self.errors}")
            time.sleep(0.002)

    def mode(self, name: str, seconds: float = 30.0) -> float:
        """Until it is in a safety mode; when, monotonic s."""
        return self.wait(lambda data: data["kind"] == "mode" and data["mode"] == name, seconds)

    def signal(self, number: int) -> float:
        """Send a signal; when, monotonic s."""
        at = time.monotonic()
        os.kill(self.pid, number)
        return at

    @property
    def code(self) -> int | None:
        """Its exit code, None where it has not ended."""
        return self._popen.poll()

    def alive(self) -> bool:
        """Whether it has not ended."""
        return self.code is None

    def finish(self, seconds: float = 20.0) -> int:
        """Its exit code, waited for."""
        try:
            code = self._popen.wait(seconds)
        except subprocess.TimeoutExpired:
            raise DisturbedError(f"{self.module} has not ended after {seconds:g} s") from None
        for reader in self._readers:
            reader.join(2.0)
        return code

    def kill(self) -> None:
        """End it at once, if it is still there."""
        if self.alive():
            self._popen.send_signal(signal.SIGCONT)
            self._popen.kill()
        self._popen.wait()
        for reader in self._readers:
            reader.join(2.0)
        for stream in (self._popen.stdout, self._popen.stderr):
            if stream is not None:
                stream.close()


def exit_code(cause: str) -> int:
    """Of a laboratory whose test was ended by this cause."""
    return 4 if cause in LOST else 3


class Place(NamedTuple):
    """Where the processes of a test are and how they reach each other."""

    listen: str
    connect: Mapping[str, str]  # by role
    before: Mapping[str, Sequence[str]]  # by role, how a command gets into its machine


def loopback(protocol: str = "tcp") -> Place:
    """All on this machine."""
    endpoint = listenable().replace("tcp", protocol)
    return Place(endpoint, {"slave": endpoint, "recorder": endpoint}, {})


class Bench:
    """Master, slave and recorder of one test, each a process that can be hurt."""

    def __init__(
        self,
        folder: Path,
        place: Place | None = None,
        *,
        duration: float = 40.0,
        more: str = "",
        recorder: str = "recorder",
        stay: bool = True,
        preflight: str = "",
        safety: str = "",
    ) -> None:
        self.folder = folder
        self.place = place or loopback()
        self._recorder = recorder
        self.path = folder / "plan.toml"
        rigs = Path(__file__).with_name("rigs.py")
        text = PLAN.format(
            duration=duration,
            interval=INTERVAL,
            folder=folder,
            rigs=rigs,
            stay=str(stay).lower(),
            preflight=preflight,
            safety=safety,
        )
        self.path.write_text(text + more)
        self.plan: Plan = plans.load(self.path)
        self.logs = {lab: Log(folder / f"{lab}.log", self.plan.ticks + SPARE) for lab in LABS}
        self.recording = folder / "a.mcap"
        self.all: list[Process] = []
        self.master: Process
        self.slave: Process
        self.recorder: Process

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        refused = self._refused()
        for process in self.all:
            process.kill()
        if isinstance(error, DisturbedError) and refused:
            raise AssertionError(f"no pause of this machine: {refused}") from error

    def _refused(self) -> list[str]:
        """Who of the three takes no part because of a file, an option or a plan: no pause of a machine does that."""
        there = [getattr(self, role, None) for role in (*LABS, "recorder")]
        return [
            f"{one.module}: {one.errors.strip()}" for one in there if one is not None and one.code == REFUSED
        ]

    def start(self, role: str, *words: str | Path, module: str = "", listen: str = "") -> Process:
        """Start the process of a role."""
        options: list[str | Path] = [self.path, "--json", *words]
        if role == "master":
            options += ["--listen", listen or self.place.listen]
        else:
            options += ["--connect", self.place.connect[role]]
        if role == "recorder":
            options += ["-o", self.recording, "--force"]  # one that is started again begins anew
        else:
            options += [] if "off" in words else processor(role)
        process = Process(module or role, *options, before=self.place.before.get(role, ()))
        self.all.append(process)
        return process

    def start_all(self) -> Self:
        """Start the three and wait until faults may come; ends them where that does not happen."""
        try:
            self.slave = self.start("slave")
            self.recorder = self.start("recorder", module=self._recorder)
            self.master = self.start("master")
            self.until(AT)
        except BaseException as error:
            self.__exit__(type(error), error, None)
            raise
        return self

    def until(self, t: float) -> None:
        """Until this time of the test."""
        self.master.wait(lambda data: data["kind"] == "progress" and data["t"] >= t - 0.2, 60.0)

    def now(self) -> float:
        """The time of the test, s, by the rig of the master."""
        return self.logs["master"].written().ns.size * INTERVAL

    def operator(self, *words: str) -> Process:
        """An operator's command, at the place of the master."""
        endpoint = self.place.connect["recorder"]
        process = Process(
            "rths",
            *words,
            "--json",
            self.path,
            "--connect",
            endpoint,
            before=self.place.before.get("master", ()),
        )
        self.all.append(process)
        return process

    def want(self, lab: str, wish: Wish) -> None:
        """Tell a laboratory's rig what to do."""
        self.logs[lab].want(wish)

    def ticked(self) -> None:
        """Until the test is over; raises DisturbedError where it tripped before: a pause of this machine does that."""
        for lab in LABS:
            self.lab(lab).finish(self.plan.test.duration + 10.0)
        for lab in LABS:
            if self.lab(lab).causes:
                raise DisturbedError(str(self.lab(lab).causes))

    def rest(self, *labs: str) -> None:
        """Until laboratories are in their safe state, which they keep; then for a moment nothing goes to a rig."""
        for lab in labs:
            self.lab(lab).mode("safe", 10.0)
        written = [self.logs[lab].written().ns.size for lab in labs]
        time.sleep(STILL)
        assert written == [self.logs[lab].written().ns.size for lab in labs]

    def lab(self, name: str) -> Process:
        """The process of a laboratory."""
        return self.master if name == "master" else self.slave

    def finish(self, *labs: str) -> Run:
        """Let the slave, then the master leave: with the exit code of what ended it and no traceback; the recording."""
        for name in reversed(labs or LABS):  # the master's session routes what the slave has to say
            self.leave(name)
        for process in self.all:
            assert "Traceback" not in process.errors, process.errors
        self._end_recorder()
        return read(self.recording)

    def leave(self, name: str) -> None:
        """Ask a laboratory that has stopped to leave; its exit code is that of the cause."""
        lab = self.lab(name)
        if lab.alive():
            lab.signal(signal.SIGTERM)
        code, causes = lab.finish(), [event["code"] for event in lab.causes]
        assert code == (exit_code(causes[0]) if causes else 0), (code, causes, lab.errors)

    def _end_recorder(self) -> None:
        """It ends with the laboratories' streams; where one was cut off it would wait for the rest."""
        deadline = time.monotonic() + 0.5
        while self.recorder.alive() and time.monotonic() < deadline:
            time.sleep(0.01)
        if self.recorder.alive():
            self.recorder.signal(signal.SIGTERM)
        self.recorder.finish()


def processor(role: str) -> list[str]:
    """The option by which a laboratory gets a processor of its own, where there are several."""
    allowed = sorted(os.sched_getaffinity(0))
    return ["--processor", str(allowed[-1 if role == "master" else 0])] if len(allowed) > 1 else []
