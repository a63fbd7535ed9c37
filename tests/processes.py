"""Processes that tests start: they end with the interpreter that started them, and waiting for them is bounded."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
from collections.abc import Mapping
from pathlib import Path

from tests.helpers import ROOT

# s, of waits that are to end a test that hangs, and nothing else: a host may stop this machine for half a minute
HANG_S = 200.0
OVER_S = 10.0  # for the last words of what was killed


def tied(*words: str | Path) -> list[str]:
    """A command that the kernel kills when the process that started it is gone, where this machine has the means."""
    setpriv = shutil.which("setpriv")
    before = [setpriv, "--pdeathsig", "KILL"] if setpriv else []
    return [*before, *map(str, words)]


def environment(**more: str) -> Mapping[str, str]:
    """Of a command that imports this checkout."""
    return os.environ | {"PYTHONPATH": str(ROOT)} | more


def finished(
    *words: str | Path,
    seconds: float,
    cwd: Path | None = None,
    env: Mapping[str, str] | None = None,
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, in a session of its own that is killed as a whole where it takes longer.

    Raises:
        subprocess.TimeoutExpired: it was killed. `subprocess.run` would go on waiting for a grandchild with the pipe.
    """
    process = subprocess.Popen(
        tied(*words),
        cwd=cwd,
        env=env,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        start_new_session=True,
    )
    with process:
        try:
            out, err = process.communicate(timeout=seconds)
        except BaseException:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.communicate(timeout=OVER_S)
            raise
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)
