"""`rths run` for a user without any real-time right, beside a process that takes the processors away now and then."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.processes import HANG_S, environment, finished, tied

# real-time priority above everything of the test: for 30 ms every half second nothing else runs on the processor
BURNER = """
import os, time
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(99))
print("ready", flush=True)
while True:
    time.sleep(0.5)
    begun = time.monotonic()
    while time.monotonic() - begun < 0.030:
        pass
"""
# root without its capabilities has no right that another user has not, and can read every Python that runs tests
WITHOUT_RIGHTS = ["setpriv", "--bounding-set=-all", "--inh-caps=-all", "--no-new-privs", "--"]
# a process may keep a real-time priority that it was started at, whatever its rights and limits are
ORDINARY = ["chrt", "--other", "0"]
WITHOUT_LIMITS = ["prlimit", "--rtprio=0", "--memlock=0", "--nice=0", "--"]
MAY_TAKE_PROCESSORS = [sys.executable, "-c", "import os; os.sched_setscheduler(0, 1, os.sched_param(99))"]
SECONDS, TICKS = 3, 1500
# Pauses of 30 ms are what is to be borne. A machine so loaded that a laboratory falls 2 s behind says nothing of them.
BEYOND = re.compile(r"was held up for \d+\.\d ms, more than 1000 intervals")
ATTEMPTS = 3


@contextlib.contextmanager
def burners() -> Iterator[None]:
    """One on each processor that this process may use."""
    with contextlib.ExitStack() as stack:
        for processor in os.sched_getaffinity(0):
            command = tied("taskset", "-c", str(processor), sys.executable, "-c", BURNER)
            burner = stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE))
            stack.callback(burner.kill)
            assert burner.stdout is not None
            assert burner.stdout.readline() == b"ready\n"
        yield


def test_a_user_without_privileges_completes_the_test_on_a_machine_that_pauses_it(tmp_path: Path) -> None:
    if os.geteuid() != 0 or subprocess.run(MAY_TAKE_PROCESSORS, check=False, timeout=HANG_S).returncode:
        pytest.skip("only root may take the processors away with FIFO 99")
    if not all(map(shutil.which, ("setpriv", "chrt", "prlimit", "taskset"))):
        pytest.skip("setpriv, chrt, prlimit and taskset of util-linux are needed")
    for attempt in range(ATTEMPTS):
        path = tmp_path / f"{attempt}.mcap"
        options = ["--duration", str(SECONDS), "-o", str(path), "--json"]
        words = [*ORDINARY, *WITHOUT_RIGHTS, *WITHOUT_LIMITS, sys.executable, "-m", "rths", "run", *options]
        with burners():
            done = finished(*words, seconds=90.0, cwd=tmp_path, env=environment())
        if not BEYOND.search(done.stderr):
            break
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["recorder"]["outcome"] == "stop"
    assert summary["recorder"]["cause"] == "completed"
    master, slave = (summary["topics"][name] for name in ("master", "slave"))
    assert master["missing"] == 0
    # a slave that the machine holds up is behind when the master completes the test, and leaves no other hole
    assert all(last == TICKS - 1 for _, last in slave["holes"])
    assert slave["recorded"] > TICKS // 2
    assert "overrun 1000 (5)" in summary["patience"]
    assert summary["late_ticks"] >= 10  # it was disturbed indeed, and says so
    shape = next(event for event in summary["events"] if event["code"] == "real_time")
    assert shape["values"]["priority"] == shape["values"]["memory_locked"] == 0.0
