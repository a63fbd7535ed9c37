"""The processes of a test on one machine: starting them, reading their reports, asking them to stop, killing them."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from queue import Empty, Queue
from typing import Any, NamedTuple

from common.roles import MASTER, kind_of, name_of

ROOT = Path(__file__).resolve().parents[2]

# s, for the rest of a pipe to be read after its process has ended: a child process of a rig may hold it open for ever.
LAST_WORDS_S = 1.0
TEXT = "text"  # kind of a line that is not a report
BEGIN = '{"kind": '  # beginning of a report; a rig may have printed text before it on the same line
REPORTS = {  # reports of master, slaves and recorder by kind, and the keys that each must have
    "event": {"lab", "level", "code", "text"},
    "state": {"lab", "state"},
    "mode": {"lab", "mode"},
    "progress": {"tick", "t"},
    "waiting": {"lab", "text"},
    "resting": {"lab", "left", "text"},
    "recording": {"file", "summary"},
}


class ProcessReport(NamedTuple):
    """One report of one process, or a line that something else in it printed (kind 'text')."""

    process: str
    data: dict[str, Any]


def understood(line: str) -> list[dict[str, Any]]:
    """The reports in a line of a process's standard output; text that a user's rig printed is of the kind 'text'."""
    printed, begin, rest = line.partition(BEGIN)
    data = report(begin + rest)
    if data is None:
        return [text(line)]
    return [text(printed), data] if printed else [data]


def report(line: str) -> dict[str, Any] | None:
    """The report in a line of a process, None where the line is not a report."""
    try:
        data = json.loads(line)
    except (ValueError, RecursionError):
        return None
    kind = data.get("kind") if isinstance(data, dict) else None
    if not isinstance(kind, str) or kind not in REPORTS or not data.keys() >= REPORTS[kind]:
        return None
    return dict(data)


def text(line: str) -> dict[str, Any]:
    """A report that holds a line which is not a report itself."""
    return {"kind": TEXT, "text": line.rstrip("\n")}


class Leash:
    """Interrupts processes when the process that holds the other end has ended, in whatever way.

    It is a pipe that nobody writes to: the kernel signals its readers when its last writer is closed. Only Linux lets a
    program choose the signal and open a pipe anew; on other systems a leash does nothing.
    """

    def __init__(self) -> None:
        self._reader, self.writer = os.pipe()

    @contextlib.contextmanager
    def end(self) -> Iterator[list[int]]:
        """Descriptors for a process to inherit; `tie` it within the context."""
        if sys.platform != "linux":
            yield []
            return
        # The end is opened anew, because the process that gets the signal is set per open file, not per descriptor.
        fresh = os.open(f"/proc/self/fd/{self._reader}", os.O_RDONLY | os.O_NONBLOCK)
        try:
            yield [fresh]
        finally:
            os.close(fresh)

    @staticmethod
    def tie(ends: Sequence[int], process: int) -> None:
        """Name the process that is interrupted."""
        if sys.platform == "linux":
            import fcntl

            for end in ends:
                fcntl.fcntl(end, fcntl.F_SETOWN, process)
                fcntl.fcntl(end, fcntl.F_SETSIG, signal.SIGINT)
                fcntl.fcntl(end, fcntl.F_SETFL, os.O_NONBLOCK | os.O_ASYNC)

    def close(self) -> None:
        """Let go."""
        os.close(self._reader)
        os.close(self.writer)


class Processes:
    """Master, slaves and recorder by role; their reports in one queue, with their errors and complaints.

    If this process is killed, the master is interrupted and ends the test in order. When the master has ended, all
    others are interrupted, which without a test nobody else would end.
    """

    def __init__(self) -> None:
        self._running: dict[str, subprocess.Popen[str]] = {}
        self._queue: Queue[ProcessReport] = Queue()  # not SimpleQueue, for the reason in common/link/inbox.py
        self._threads: list[threading.Thread] = []
        self._home, self._lead = Leash(), Leash()  # held by this process, and by this one and the master
        self._read_until = 0.0
        self._complaints: dict[str, list[str]] = {}
        self.errors: dict[str, str] = {}  # code of the first error that each reported
        self.asked: set[str] = set()
        self.killed: set[str] = set()

    def start(self, name: str, arguments: Sequence[str]) -> None:
        """Start `python -m name arguments --json`, where the terminal's Ctrl-C does not reach it."""
        own = ["--name", name_of(name)] if name_of(name) else []
        leash, held = (self._home, [self._lead.writer]) if name == MASTER else (self._lead, [])
        with leash.end() as ends:
            process = subprocess.Popen(
                [sys.executable, "-m", kind_of(name), *arguments, *own, "--json"],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                start_new_session=True,
                env={**os.environ, "PYTHONPATH": str(ROOT)},
                pass_fds=[*ends, *held],
            )
            leash.tie(ends, process.pid)
        self._running[name] = process
        self._complaints[name] = []
        for read in (self._listen, self._keep):
            thread = threading.Thread(target=read, args=(name, process), daemon=True)
            thread.start()
            self._threads.append(thread)

    def _listen(self, name: str, process: subprocess.Popen[str]) -> None:
        assert process.stdout is not None  # noqa: S101 - it is a pipe
        with process.stdout as lines:
            for line in lines:
                for data in understood(line):
                    if data["kind"] == "event" and data["level"] == "error":
                        self.errors.setdefault(name, data["code"])
                    self._queue.put(ProcessReport(name, data))

    def _keep(self, name: str, process: subprocess.Popen[str]) -> None:
        assert process.stderr is not None  # noqa: S101 - it is a pipe
        with process.stderr as lines:
            for line in lines:
                self._complaints[name].append(line)

    def next_report(self, timeout: float) -> ProcessReport | None:
        """The next report, waiting at most `timeout` s."""
        try:
            return self._queue.get(timeout=timeout)
        except Empty:
            return None

    def complaint(self, name: str) -> str:
        """What a process has written on standard error."""
        return "".join(self._complaints[name]).strip()

    def ended(self) -> dict[str, int]:
        """Exit codes of the processes that have ended."""
        return {name: code for name, process in self._running.items() if (code := process.poll()) is not None}

    def all_ended(self) -> bool:
        """Whether all processes have ended and their reports were read, as far as their pipes could be read out."""
        if len(self.ended()) < len(self._running):
            return False
        self._read_out()
        return self._queue.empty()

    def _read_out(self) -> None:
        """Wait for the readers, for a bounded time."""
        self._read_until = self._read_until or time.monotonic() + LAST_WORDS_S
        for thread in self._threads:
            thread.join(max(self._read_until - time.monotonic(), 0.0))

    @property
    def names(self) -> tuple[str, ...]:
        """The processes that were started."""
        return tuple(self._running)

    def ask(self, name: str, number: signal.Signals) -> None:
        """Ask one process to stop in order by a signal, once."""
        if name not in self.asked and self._running[name].poll() is None:
            self.asked.add(name)
            self._running[name].send_signal(number)

    def kill(self, name: str) -> None:
        """End one process at once."""
        if self._running[name].poll() is None:
            self.killed.add(name)
            self._running[name].kill()

    def close(self) -> None:
        """End all processes and threads."""
        for name, process in self._running.items():
            self.kill(name)
            process.wait()
        self._read_out()
        self._home.close()
        self._lead.close()
