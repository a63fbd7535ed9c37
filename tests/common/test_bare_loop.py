"""The bare timing loop: its arithmetic, and its run as a process beside a test."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from common.host import bare_loop
from common.host.bare_loop import BareLoop, Lateness
from common.host.realtime import NOTHING, Granted
from tests.helpers import ROOT
from tests.processes import HANG_S

INTERVAL_NS = 2_000_000


def gone(pid: int, seconds: float = 10.0) -> bool:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        try:
            if Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z":
                return True  # ended; whoever took it over has not looked yet
        except OSError:
            return True
        time.sleep(0.01)
    return False


def process_id(loop: BareLoop) -> int:
    process = loop._process
    assert process is not None
    assert process.stdout is not None
    assert process.stdout.readline() == b"ready\n"
    return process.pid


def test_percentiles_round_up_to_the_bin_and_end_at_the_exact_maximum() -> None:
    lateness = Lateness(INTERVAL_NS)
    for late in range(1, 1001):
        assert lateness.woke(late * 1000 - 1) == 1  # 1 to 1000 µs, less 1 ns
    values = lateness.values()
    assert values["p50"] == pytest.approx(500e-6, abs=1e-9)
    assert values["p99.9"] == pytest.approx(999e-6, abs=1e-9)
    assert values["max"] == 999.999e-6
    assert (values["ticks"], values["late"]) == (1000, 0)


def test_missed_ticks_are_skipped_and_each_counts_with_its_own_lateness() -> None:
    lateness = Lateness(INTERVAL_NS)
    assert lateness.woke(5_500_000) == 3  # ticks 5.5 and 3.5 ms late are missed, the third woke 1.5 ms late
    values = lateness.values()
    assert (values["ticks"], values["late"]) == (1, 2)
    assert values["p50"] == pytest.approx(3.501e-3)
    assert values["p90"] == values["max"] == 5.5e-3


def test_an_hour_of_missed_ticks_is_counted_in_one_step() -> None:
    lateness = Lateness(INTERVAL_NS)
    assert lateness.woke(3_600_000_000_000) == 1_800_001
    values = lateness.values()
    assert (values["ticks"], values["late"]) == (1, 1_800_000)
    assert sum(lateness._bins) == 1_800_001
    assert values["p50"] == values["max"] == 3600.0


def test_a_loop_beside_a_test_returns_its_lateness_figures() -> None:
    loop = BareLoop()
    loop.start(INTERVAL_NS, NOTHING)
    pid = process_id(loop)
    time.sleep(0.2)
    values = loop.stop()
    assert values["interval"] == 0.002
    assert values["ticks"] + values["late"] >= 50  # of 100: it may have begun late
    assert 0.0 < values["p50"] <= values["p90"] <= values["p99"] <= values["p99.9"] <= values["max"]
    assert (values["priority"], values["processor"]) == (0.0, -1.0)
    assert not Path(f"/proc/{pid}").exists()
    assert loop.stop() == {}


def test_a_stopped_process_skips_its_ticks_and_accounts_for_all_time() -> None:
    loop = BareLoop()
    began = time.monotonic()
    loop.start(INTERVAL_NS, NOTHING)
    pid = process_id(loop)
    ready = time.monotonic()
    time.sleep(0.1)
    os.kill(pid, signal.SIGSTOP)
    time.sleep(0.2)
    os.kill(pid, signal.SIGCONT)
    time.sleep(0.1)
    stopping = time.monotonic()
    values = loop.stop()
    ended = time.monotonic()
    assert values["late"] >= 95
    assert values["max"] >= 0.195
    assert (stopping - ready) / 0.002 - 25 <= values["ticks"] + values["late"] <= (ended - began) / 0.002 + 1


@pytest.mark.skipif(sys.platform != "linux", reason="real-time scheduling is made for Linux here")
def test_the_loop_runs_on_the_watched_processs_processor_at_a_higher_priority() -> None:
    try:
        policy = os.sched_getscheduler(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        os.sched_setscheduler(0, policy, os.sched_param(0))
    except PermissionError as error:
        pytest.skip(f"real-time scheduling is not permitted here: {error}")
    place = min(os.sched_getaffinity(0))
    loop = BareLoop()
    loop.start(INTERVAL_NS, Granted(priority=10, processor=place, memory_locked=False, missing=()))
    pid = process_id(loop)
    assert os.sched_getscheduler(pid) == os.SCHED_FIFO
    assert os.sched_getparam(pid).sched_priority == 11
    assert os.sched_getaffinity(pid) == {place}
    assert loop.stop()["priority"] == 11.0


def test_the_loop_ends_when_its_parent_is_killed() -> None:
    text = (
        "import time; from common.host.bare_loop import BareLoop; from common.host.realtime import NOTHING;"
        "loop = BareLoop(); loop.start(2_000_000, NOTHING); print(loop._process.pid, flush=True); time.sleep(60)"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c", text],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert parent.stdout is not None
    pid = int(parent.stdout.readline())
    parent.kill()
    parent.communicate()
    assert gone(pid)


def test_a_loop_that_was_killed_hangs_or_never_started_gives_no_figures(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    loop = BareLoop()
    loop.start(INTERVAL_NS, NOTHING)
    os.kill(process_id(loop), signal.SIGKILL)
    assert loop.stop() == {}
    loop.start(INTERVAL_NS, NOTHING)
    pid = process_id(loop)
    os.kill(pid, signal.SIGSTOP)
    monkeypatch.setattr(bare_loop, "PATIENCE", 0.1)
    assert loop.stop() == {}
    assert not Path(f"/proc/{pid}").exists()
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    loop.start(INTERVAL_NS, NOTHING)
    assert loop.stop() == {}


def test_the_loop_runs_as_a_module_and_imports_few_modules() -> None:
    heavy = {"numpy", "typing", "subprocess", "asyncio"}
    text = f"import sys, common.host.bare_loop; print(sorted(set(sys.modules) & {heavy}))"
    environment = {"PYTHONPATH": str(ROOT)}
    bare = subprocess.run(
        [sys.executable, "-S", "-c", text], capture_output=True, text=True, env=environment, timeout=HANG_S
    )
    assert bare.stdout == "[]\n"
    done = subprocess.run(
        [sys.executable, "-m", "common.host.bare_loop", "1000000"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        env=environment,
        timeout=HANG_S,
    )
    ready, line = done.stdout.splitlines()
    assert ready == "ready"
    assert json.loads(line)["interval"] == 0.001
    refused = subprocess.run(
        [sys.executable, "-m", "common.host.bare_loop", "5"],
        capture_output=True,
        text=True,
        env=environment,
        timeout=HANG_S,
    )
    assert refused.returncode == 2
    assert "is too short" in refused.stderr
