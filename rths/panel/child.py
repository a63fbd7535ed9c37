"""Commands that the panel runs as processes of their own: `rths run`, whose reports it reads, and the checks."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Sequence
from typing import Any

from common.safety.modes import Mode
from report.panel.snapshot import CheckResult, RunReports
from rths.perform.processes import ROOT

KEPT = 12  # lines that are shown of what a command says
CAUSES = 4  # of the end of a test: one for each laboratory of a usual one
READY = "await_start"  # code of the event with which the master says that armed rigs wait for a start


def started(words: Sequence[str], out: int) -> subprocess.Popen[str]:
    """A command of rths that neither the panel's terminal nor its end stops; its standard error is a pipe."""
    return subprocess.Popen(
        [sys.executable, "-m", "rths", *words],
        stdin=subprocess.DEVNULL,
        stdout=out,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


class RunCommand:
    """`rths run` with its reports; when the panel ends the test goes on, because its command outlives its reader."""

    def __init__(self, words: Sequence[str]) -> None:
        self.ready = False  # whether armed rigs wait for the start
        self.moved = False  # whether a laboratory has run
        self._modes: dict[str, tuple[str, int]] = {}
        self._alive: tuple[tuple[str, ...], int] = ((), 0)
        self._causes: list[tuple[str, str]] = []
        self._lines: deque[str] = deque(maxlen=KEPT)
        self._process = started(["run", *words, "--await-start", "--reports"], subprocess.DEVNULL)
        self._reader = threading.Thread(target=self._listen, daemon=True)
        self._reader.start()

    def _listen(self) -> None:
        assert self._process.stderr is not None  # noqa: S101 - it is a pipe
        with self._process.stderr as lines:
            for line in lines:
                self._take(line)

    def _take(self, line: str) -> None:
        now = time.monotonic_ns()
        data: Any = {"kind": "text", "text": line.strip().removeprefix("rths: ")}
        with contextlib.suppress(ValueError):
            data = json.loads(line)
        match data:
            case {"kind": "mode", "lab": str(lab), "mode": str(mode)}:
                self._modes = {**self._modes, lab: (mode, now)}
                self.moved = self.moved or mode == Mode.RUNNING.value
            case {"kind": "alive", "processes": list(names)}:
                self._alive = tuple(map(str, names)), now
            case {"kind": "event", "level": "error", "lab": str(lab), "text": str(text)}:
                self._causes = [*self._causes, (lab, text)][:CAUSES]
            case {"kind": "event", "code": code, "lab": str(lab), "text": str(text)}:
                self.ready = self.ready or code == READY
                self._lines.append(f"{lab}: {text}")
            case {"kind": "text", "text": str(text)} if text:
                self._lines.append(text)
            case _:
                pass

    @property
    def process(self) -> int:
        """The number of its process."""
        return self._process.pid

    @property
    def reports(self) -> RunReports:
        """What it has reported."""
        names, at = self._alive
        return RunReports(self._modes, names, at, tuple(self._causes), tuple(self._lines))

    @property
    def over(self) -> bool:
        """Whether it has ended and everything it wrote was read."""
        return self._process.poll() is not None and not self._reader.is_alive()

    @property
    def code(self) -> int:
        """The exit code of the ended command."""
        return self._process.wait()

    def interrupt(self) -> None:
        """Ask it to end the test in order, as Ctrl-C does."""
        self._process.send_signal(signal.SIGINT)


class Check:
    """A command that describes something as JSON on its standard output."""

    def __init__(self, words: Sequence[str]) -> None:
        self._at = time.monotonic_ns()
        self._out = self._err = ""
        self._process = started([*words, "--json"], subprocess.PIPE)
        self._reader = threading.Thread(target=self._wait, daemon=True)
        self._reader.start()

    def _wait(self) -> None:
        self._out, self._err = self._process.communicate()

    @property
    def busy(self) -> CheckResult:
        """What is known while it runs."""
        return CheckResult(at=self._at, busy=True)

    @property
    def found(self) -> CheckResult | None:
        """What it found, None while it runs."""
        if self._reader.is_alive():
            return None
        with contextlib.suppress(ValueError):
            return CheckResult(json.loads(self._out), at=self._at)
        lines = self._err.strip().removeprefix("rths: ").splitlines()
        return CheckResult(complaint=lines[-1] if lines else "The check ended without a word.", at=self._at)

    def end(self) -> None:
        """End it."""
        self._process.kill()
        self._reader.join()
