"""The live view beside a test: a process of its own, which can neither end the test nor delay it."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from collections import deque
from pathlib import Path
from queue import Empty, SimpleQueue

from rths.perform.processes import ROOT, Leash

# s, for the view to send the end of the test to the page, which it updates ten times a second, and to end.
LEAVE_S = 4.0
READY = "live view: "  # beginning of the line with the address of its page


class View:
    """A live view of the recording of a test that is about to start."""

    def __init__(self, recording: Path, port: int) -> None:
        self._recording = recording
        self._said: SimpleQueue[str] = SimpleQueue()
        self._last: deque[str] = deque(maxlen=1)
        self._leash = Leash()
        self._process: subprocess.Popen[str] | None = None
        self._reader: threading.Thread | None = None
        self._over = False
        words = [str(recording), "--wait", "--leave", "--no-browser", "--port", str(port)]
        try:
            with self._leash.end() as ends:
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "rths.perform.live", *words],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    text=True,
                    errors="replace",
                    start_new_session=True,
                    env={**os.environ, "PYTHONPATH": str(ROOT)},
                    pass_fds=ends,
                )
                self._leash.tie(ends, self._process.pid)
        except OSError as error:
            self._last.append(error.strerror or "it could not be started")
            return
        self._reader = threading.Thread(target=self._listen, args=(self._process,), daemon=True)
        self._reader.start()

    def _listen(self, process: subprocess.Popen[str]) -> None:
        assert process.stdout is not None  # noqa: S101 - it is a pipe
        with process.stdout as lines:
            for line in lines:
                if line.startswith(READY):
                    self._said.put(line.strip())
                elif line.strip():
                    self._last.append(line.strip())

    def news(self) -> str:
        """A line for the user: the address of the page, or that the view has ended; empty where there is no news."""
        with contextlib.suppress(Empty):
            return self._said.get_nowait()
        code = self._process.poll() if self._process else 1
        if self._over or code in (None, 0):
            return ""
        self._over = True
        why = self._last[0].removeprefix("rths: ") if self._last else f"exit code {code}"
        return f"live view: it has ended ({why}); the test goes on, and {self.again} shows it again."

    @property
    def again(self) -> str:
        """The command that shows the recording again."""
        return f"rths live {self._recording}"

    @staticmethod
    def _await(process: subprocess.Popen[str]) -> None:
        for number in (0, signal.SIGTERM, signal.SIGKILL):  # 0 is none
            process.send_signal(number)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(LEAVE_S)
                return

    def close(self) -> None:
        """Let the view show the end of the test for a moment, then end it."""
        if self._process is not None:
            if not (self._recording.is_file() and self._recording.stat().st_size):  # there is no end to show
                self._process.terminate()
            self._await(self._process)
            if self._reader is not None:
                self._reader.join(LEAVE_S)
        self._leash.close()
