"""The real-time settings that a test takes on its machine, and their record in the recording."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from common.host.realtime import PRIORITY
from common.link.zenoh_link import listenable
from common.recording.reader import read
from common.recording.run import MACHINES
from tests.processes import HANG_S, environment, tied

pytestmark = pytest.mark.slow

RTHS = [sys.executable, "-m", "rths"]
ALLOWED = subprocess.run(
    [sys.executable, "-c", f"import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param({PRIORITY}))"],
    capture_output=True,
    check=False,
    timeout=HANG_S,
)
fifo = pytest.mark.skipif(
    ALLOWED.returncode != 0, reason="real-time priority is not allowed here: run as root"
)


def machines(path: Path, *words: str) -> dict[str, str]:
    """What the recording of a short test says of its machines."""
    command = [*RTHS, "run", "--duration", "1", *words, "-o", str(path)]
    subprocess.run(
        command, cwd=path.parent, env=environment(), check=True, capture_output=True, timeout=HANG_S
    )
    return read(path).metadata.get(MACHINES, {})


@fifo
def test_both_laboratories_have_real_time_priority_and_the_recording_states_it(tmp_path: Path) -> None:
    found = machines(tmp_path / "a.mcap")
    assert found["master.scheduler"] == found["slave.scheduler"] == f"fifo {PRIORITY}"
    if len(os.sched_getaffinity(0)) > 1:
        assert found["master.processor"] != found["slave.processor"]
    assert 0.0 <= float(found["master.stolen_share"]) <= 1.0
    ticks = float(found["bare_loop.ticks"]) + float(found["bare_loop.late"])
    assert 500 <= ticks < 1500  # beside the test's, those of the lead before its start and of its end
    assert float(found["bare_loop.p50"]) <= float(found["bare_loop.p99"]) <= float(found["bare_loop.max"])


def test_without_real_time_priority_the_recording_states_that(tmp_path: Path) -> None:
    found = machines(tmp_path / "a.mcap", "--rt", "off")
    assert found["master.scheduler"] == found["slave.scheduler"] == "other"
    assert float(found["master.memory_locked"]) == 0.0
    assert "bare_loop.p99" in found


def test_a_recording_in_virtual_time_states_nothing_about_a_machine(tmp_path: Path) -> None:
    assert machines(tmp_path / "a.mcap", "--virtual") == {}


def link_threads(process: int) -> dict[str, int]:
    """Scheduling policies of zenoh's threads in a process, by their names."""
    found = {}
    for task in Path(f"/proc/{process}/task").iterdir():
        with contextlib.suppress(OSError):  # a thread may have ended meanwhile
            name = (task / "comm").read_text().strip()
            if name.startswith(("rx-", "tx-", "net-", "acc-", "app-")):
                found[name] = os.sched_getscheduler(int(task.name))
    return found


@fifo
def test_the_threads_of_the_link_inherit_the_priority() -> None:
    listen = listenable()
    laboratories = [
        subprocess.Popen(
            tied(*RTHS, role, "default", option, listen, "--rt", "on"),
            env=environment(),
            stderr=subprocess.DEVNULL,
        )
        for role, option in (("master", "--listen"), ("slave", "--connect"))
    ]  # they wait for a recorder
    try:
        for laboratory in laboratories:
            deadline = time.monotonic() + HANG_S
            found: dict[str, int] = {}
            while not {name[:3] for name in found} >= {"rx-", "tx-"} and time.monotonic() < deadline:
                time.sleep(0.1)
                found = link_threads(laboratory.pid)
            assert {name[:3] for name in found} >= {"rx-", "tx-"}
            assert set(found.values()) == {os.SCHED_FIFO}, found
    finally:
        for laboratory in laboratories:
            laboratory.kill()
            laboratory.wait()
