"""Runs a command beside a process that disturbs it: `python3 -m tests.disturbed COMMAND …`, such as `make test`.

The process computes all the time on one core after the other, and where it may (root), takes that core from everybody
for a moment every tenth of a second, as a host does that has other guests. The exit code is the command's.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import subprocess
import sys
import time

PERIOD_S = 0.1
PAUSE_S = 0.012
PRIORITY = 90  # above every laboratory's


def busy(seconds: float) -> None:
    """Compute for a while."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        pass


def disturb(parent: int) -> None:
    """Take the cores in turn until the process that started this one is gone."""
    for core in itertools.cycle(sorted(os.sched_getaffinity(0))):
        if os.getppid() != parent:
            return
        os.sched_setaffinity(0, {core})
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
            busy(PAUSE_S)
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        busy(PERIOD_S - PAUSE_S)


def main(words: list[str]) -> int:
    """Run the command; its exit code."""
    own = [sys.executable, "-m", "tests.disturbed", "--disturb", str(os.getpid())]
    with subprocess.Popen(own) as disturber:
        try:
            return subprocess.run(words, check=False).returncode
        finally:
            disturber.kill()


if __name__ == "__main__":
    if sys.argv[1:2] == ["--disturb"]:
        disturb(int(sys.argv[2]))
    else:
        sys.exit(main(sys.argv[1:]))
