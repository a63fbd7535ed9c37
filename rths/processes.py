"""The three processes of a test on one machine: started, listened to, stopped in order."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple

from common.roles import MASTER, kind_of, name_of

ROOT = Path(__file__).resolve().parent.parent


LEADER = MASTER  # the process that ends the test for all
PR_SET_PDEATHSIG = 1


def end_with_parent() -> None:
    """Have the kernel interrupt this process when the one that started it is killed."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGINT, 0, 0, 0)


class Said(NamedTuple):
    """One report of one process."""

    process: str
    data: dict[str, Any]


class Processes:
    """Master, slaves and recorder by role; their reports in one queue, their complaints kept."""

    def __init__(self) -> None:
        self._running: dict[str, subprocess.Popen[str]] = {}
        self._queue: SimpleQueue[Said] = SimpleQueue()
        self._threads: list[threading.Thread] = []
        self.complaints: dict[str, str] = {}

    def start(self, name: str, arguments: Sequence[str]) -> None:
        """Start `python -m name arguments --json`, out of reach of the terminal's Ctrl-C; a slave with its name."""
        own = ["--name", name_of(name)] if name_of(name) else []
        process = subprocess.Popen(
            [sys.executable, "-m", kind_of(name), *arguments, *own, "--json"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            preexec_fn=end_with_parent if name == LEADER and sys.platform == "linux" else None,  # noqa: PLW1509
        )
        self._running[name] = process
        for read in (self._listen, self._keep):
            thread = threading.Thread(target=read, args=(name, process), daemon=True)
            thread.start()
            self._threads.append(thread)

    def _listen(self, name: str, process: subprocess.Popen[str]) -> None:
        assert process.stdout is not None  # noqa: S101 - it is a pipe
        for line in process.stdout:
            self._queue.put(Said(name, json.loads(line)))

    def _keep(self, name: str, process: subprocess.Popen[str]) -> None:
        assert process.stderr is not None  # noqa: S101 - it is a pipe
        self.complaints[name] = process.stderr.read().strip()

    def said(self, timeout: float) -> Said | None:
        """The next report, waiting at most `timeout` s."""
        try:
            return self._queue.get(timeout=timeout)
        except Empty:
            return None

    def ended(self) -> dict[str, int]:
        """Exit codes of the processes that have ended."""
        return {name: code for name, process in self._running.items() if (code := process.poll()) is not None}

    def all_ended(self) -> bool:
        """Whether all processes have ended and all they said was read."""
        if len(self.ended()) < len(self._running):
            return False
        for thread in self._threads:
            thread.join()
        return self._queue.empty()

    @property
    def names(self) -> tuple[str, ...]:
        """The processes that were started."""
        return tuple(self._running)

    def interrupt(self, name: str) -> None:
        """Ask one process to stop in order."""
        if self._running[name].poll() is None:
            self._running[name].send_signal(signal.SIGINT)

    def kill(self) -> None:
        """End what is still there."""
        for process in self._running.values():
            if process.poll() is None:
                process.kill()
            process.wait()
