"""The measures that keep a test run from hanging and from leaving processes behind."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests import limited
from tests.helpers import ROOT
from tests.processes import HANG_S, environment, finished

LIMITED = [sys.executable, "-I", str(ROOT / "tests" / "limited.py")]
ELSEWHERE = (
    "import os, sys, time; os.setsid(); open(sys.argv[1], 'w').write(str(os.getpid())); time.sleep(60)"
)
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="orphans are adopted on Linux alone")

HANGS = """
import ctypes, subprocess, sys, threading, time
import pytest

def test_that_waits_for_ever():
    threading.Event().wait()

def test_that_no_signal_reaches():
    held = ctypes.create_string_buffer(64)
    lock = ctypes.PyDLL(None).pthread_mutex_lock
    lock(held), lock(held)

def test_that_leaves_a_process():
    subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])

def test_after_them():
    pass
"""
GUARDS = """
import tests.conftest as guards
from tests.conftest import no_leaked_process, pytest_configure, pytest_runtest_protocol, pytest_sessionfinish
guards.OUT_OF_REACH_S = 0.5
"""


def alive(pid: int) -> bool:
    return limited.look(pid) is not None


def number_in(path: Path) -> int:
    """The process number that a process writes into a file as soon as it runs."""
    deadline = time.monotonic() + HANG_S
    while not (path.exists() and path.read_text()):
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return int(path.read_text())


@pytest.mark.parametrize(("command", "code"), [("exit 0", 0), ("exit 3", 3), ("kill -9 $$", 128 + 9)])
def test_the_exit_code_of_the_limiter_is_the_commands(command: str, code: int) -> None:
    done = finished(*LIMITED, "it", "30", "bash", "-c", command, seconds=60.0)
    assert (done.returncode, done.stderr) == (code, "")


@pytest.mark.slow
@LINUX
def test_a_command_that_takes_too_long_is_ended_with_its_child_processes(tmp_path: Path) -> None:
    script = (
        f'"{sys.executable}" -c "{ELSEWHERE}" number & until test -s number; do sleep 0.1; done; sleep 60'
    )
    done = finished(*LIMITED, "set-up", "3", "bash", "-c", script, seconds=60.0, cwd=tmp_path)
    assert done.returncode == limited.RAN_OUT
    assert "set-up: not done after 3 s\n" in done.stderr
    assert not alive(number_in(tmp_path / "number"))


@LINUX
def test_processes_that_a_command_leaves_are_named_and_killed(tmp_path: Path) -> None:
    script = f'"{sys.executable}" -c "{ELSEWHERE}" number & until test -s number; do sleep 0.1; done'
    done = finished(*LIMITED, "tests", "30", "bash", "-c", script, seconds=60.0, cwd=tmp_path)
    left = number_in(tmp_path / "number")
    assert done.returncode == 0
    assert done.stderr.startswith(f"tests: killed what was left: {left} (")
    assert not alive(left)


@LINUX
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_no_process_outlives_its_limiter(number: int, tmp_path: Path) -> None:
    program = "import os, time; open('number', 'w').write(str(os.getpid())); time.sleep(60)"
    with subprocess.Popen([*LIMITED, "it", "50", sys.executable, "-c", program], cwd=tmp_path) as limiting:
        pid = number_in(tmp_path / "number")
        limiting.send_signal(number)
    deadline = time.monotonic() + HANG_S
    while alive(pid) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not alive(pid)


def session(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """A run of pytest over the tests of a folder."""
    own = {name: value for name, value in environment().items() if not name.startswith("PYTEST")}
    command = [sys.executable, "-m", "pytest", "-n", "1", "-p", "no:cacheprovider", *words]
    return finished(*command, seconds=120.0, cwd=folder, env=own)


@pytest.mark.slow
@LINUX
def test_a_test_that_hangs_fails_with_its_stacks_and_the_others_go_on(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_text(GUARDS)
    (tmp_path / "test_hangs.py").write_text(HANGS)
    done = session(tmp_path, "-rA", "-o", "timeout=2", "-o", "timeout_method=signal")
    said = done.stdout + done.stderr
    assert done.returncode == 1
    assert re.search(r"FAILED .*test_that_waits_for_ever - Failed: Timeout", said)
    assert re.search(r"FAILED .*test_that_no_signal_reaches - worker .* crashed", said)
    assert re.search(r'File ".*test_hangs.py", line 11 in test_that_no_signal_reaches', said)
    assert re.search(r"ERROR .*test_that_leaves_a_process", said)
    assert re.search(r"PASSED .*test_after_them", said)


@LINUX
def test_processes_that_a_test_starts_are_killed_with_its_interpreter(tmp_path: Path) -> None:
    program = (
        "import subprocess, sys, time; from tests.processes import tied\n"
        f"child = subprocess.Popen(tied(sys.executable, '-c', {ELSEWHERE!r}, 'number')); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", program], cwd=tmp_path, env=environment()) as starting:
        pid = number_in(tmp_path / "number")
        os.kill(starting.pid, signal.SIGKILL)
    deadline = time.monotonic() + HANG_S
    while alive(pid) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not alive(pid)
