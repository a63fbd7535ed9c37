"""The real-time privileges of a process, tested in child processes so that the tests' own process is unchanged."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

import pytest

from common.errors import InputError
from common.host import realtime
from tests.helpers import ROOT
from tests.processes import HANG_S

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="real-time scheduling is made for Linux here")

BARE = """
import os, resource
if os.geteuid() == 0:
    os.setgroups([]); os.setgid(65534); os.setuid(65534)
resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
"""  # a process without a privilege, its modules already loaded


def child(text: str) -> subprocess.CompletedProcess[str]:
    lines = f"""
import gc, json, os, resource, sys, threading
from common.terminal import cli
from common.host import realtime
from common.host.machine import scheduler_name
from tests.processes import HANG_S
def say(**values): print(json.dumps(values))
{text}
"""
    return subprocess.run(
        [sys.executable, "-c", lines],
        capture_output=True,
        text=True,
        timeout=HANG_S,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def output_of(text: str) -> dict[str, Any]:
    done = child(text)
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.fixture(scope="session")
def permitted() -> None:
    """Skips where real-time scheduling is not permitted."""
    done = child("os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(realtime.PRIORITY))")
    if done.returncode:
        pytest.skip(f"real-time scheduling is not permitted here: {done.stderr.strip().splitlines()[-1]}")


@pytest.mark.usefixtures("permitted")
def test_threads_and_processes_started_later_inherit_priority_and_processor() -> None:
    found = output_of("""
place = min(os.sched_getaffinity(0))
granted = realtime.prepare("auto", place)
seen = []
def look(): seen.append([scheduler_name(threading.get_native_id()), sorted(os.sched_getaffinity(0))])
thread = threading.Thread(target=look); thread.start(); thread.join()
pid = os.fork()
if pid == 0:
    os._exit(os.sched_getscheduler(0) != os.SCHED_FIFO)
say(granted=granted._asdict(), place=place, seen=seen, forked=os.waitpid(pid, 0)[1])
""")
    assert found["granted"]["priority"] == realtime.PRIORITY
    assert found["granted"]["processor"] == found["place"]
    assert found["seen"] == [[f"fifo {realtime.PRIORITY}", [found["place"]]]]
    assert found["forked"] == 0


@pytest.mark.usefixtures("permitted")
def test_the_reset_on_fork_flag_of_the_scheduler_is_cleared() -> None:
    found = output_of("""
os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(1))
realtime.prepare("auto", None)
say(policy=os.sched_getscheduler(0))
""")
    assert found["policy"] == os.SCHED_FIFO


@pytest.mark.usefixtures("permitted")
def test_a_privileged_process_gets_priority_and_processor_and_locks_its_memory() -> None:
    found = output_of("""
granted = realtime.prepare("auto", None)
locked = next(line for line in open("/proc/self/status") if line.startswith("VmLck:"))
say(granted=granted._asdict(), values=granted.values(), locked=int(locked.split()[1]))
""")
    if any("Memory" in sentence for sentence in found["granted"]["missing"]):
        pytest.skip(f"memory cannot be locked here: {found['granted']['missing']}")
    assert found["locked"] > 1000
    assert found["values"] == {
        "priority": realtime.PRIORITY,
        "processor": -1.0,
        "memory_locked": 1.0,
        "missing": 0.0,
    }


def test_mode_off_leaves_the_scheduling_unchanged_and_tightens_timers() -> None:
    found = output_of("""
before = os.sched_getaffinity(0)
granted = realtime.prepare("off", None)
slack = int(open("/proc/self/timerslack_ns").read())
say(granted=granted._asdict(), free=os.sched_getaffinity(0) == before, scheduler=scheduler_name(),
    slack=slack, switch=sys.getswitchinterval())
""")
    assert found["granted"] == realtime.NOTHING._asdict() | {"missing": []}
    assert found["free"]
    assert found["scheduler"] == "other"
    assert found["slack"] <= 1
    assert found["switch"] == pytest.approx(realtime.SWITCH_INTERVAL)


def test_without_privilege_mode_auto_names_what_is_missing_and_continues() -> None:
    found = output_of(f"""
{BARE}
resource.setrlimit(resource.RLIMIT_MEMLOCK, (65536, 65536))
before = os.sched_getaffinity(0)
granted = realtime.prepare("auto", min(before))
big = bytearray(50_000_000)
say(granted=granted._asdict(), free=os.sched_getaffinity(0) == before)
""")
    granted = found["granted"]
    assert (granted["priority"], granted["processor"], granted["memory_locked"]) == (0, -1, False)
    priority, processor, memory = granted["missing"]
    assert priority.startswith("No real-time priority: the limit RLIMIT_RTPRIO is 0; run as root")
    assert processor.startswith("Not bound to processor")
    assert memory.startswith("Memory is not locked: the limit RLIMIT_MEMLOCK is 64 KiB")
    assert found["free"]


def test_without_privilege_mode_on_ends_with_one_line_and_exit_code_2() -> None:
    done = child(f"{BARE}\nsys.exit(cli.guarded(lambda: bool(realtime.prepare('on', None)) and 0))")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("rths: No real-time priority: the limit RLIMIT_RTPRIO is 0; run as root")
    assert done.stderr.count("\n") == 1


def test_an_unlimited_memory_limit_is_enough_without_privilege() -> None:
    found = output_of(f"""
{BARE}
realtime.raised = lambda name, wanted: -1
sentence = realtime.lock_memory()
say(sentence=sentence)
""")
    assert "RLIMIT_MEMLOCK is" not in found["sentence"]


def test_a_resource_limit_is_raised_to_the_hard_limit_and_not_beyond() -> None:
    found = output_of("""
resource.setrlimit(resource.RLIMIT_NOFILE, (64, 128))
if os.geteuid() == 0:
    os.setgroups([]); os.setuid(65534)
limits = [realtime.raised("RLIMIT_NOFILE", wanted) for wanted in (32, 100, -1)]
say(limits=limits, hard=resource.getrlimit(resource.RLIMIT_NOFILE)[1])
""")
    assert found == {"limits": [64, 100, 128], "hard": 128}


def test_memory_is_not_locked_where_too_little_would_remain() -> None:
    found = output_of("""
realtime.spare_memory = lambda: 10_000_000
realtime.raised = lambda name, wanted: -1
say(sentence=realtime.lock_memory())
""")
    assert found["sentence"].startswith("Memory is not locked: the process holds")
    assert "9 MiB are spare" in found["sentence"]


def test_a_priority_limit_below_the_wanted_priority_gives_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []

    def schedule(_pid: int, policy: int, parameter: os.sched_param) -> None:
        tried.append((policy, parameter.sched_priority))
        if parameter.sched_priority > 20:
            raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", schedule)
    monkeypatch.setattr(realtime, "raised", lambda _name, _wanted: 20)
    assert realtime.raise_priority() == (20, "")
    assert tried == [(os.SCHED_FIFO, realtime.PRIORITY), (os.SCHED_FIFO, 20)]


def test_a_refusal_within_the_limit_points_at_the_control_group(monkeypatch: pytest.MonkeyPatch) -> None:
    def schedule(*_arguments: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", schedule)
    monkeypatch.setattr(realtime, "raised", lambda _name, _wanted: 95)
    priority, sentence = realtime.raise_priority()
    assert priority == 0
    assert "though the limit RLIMIT_RTPRIO is 95" in sentence
    assert "cpu.rt_runtime_us" in sentence


@pytest.mark.parametrize("mode", ["auto", "on"])
@pytest.mark.parametrize("processor", [4095, -1])
def test_an_absent_processor_is_refused_and_the_present_ones_are_named(mode: str, processor: int) -> None:
    done = child(f"sys.exit(cli.guarded(lambda: bool(realtime.prepare({mode!r}, {processor})) and 0))")
    allowed = ", ".join(map(str, sorted(os.sched_getaffinity(0))))
    assert done.returncode == 2
    assert done.stderr.startswith(f"rths: There is no processor {processor} for this process: it may use ")
    assert f" {allowed} only; choose one of these" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("processor", [0, 4095, -1])
def test_a_processor_is_refused_in_mode_off(processor: int) -> None:
    with pytest.raises(InputError, match="--processor needs --rt auto or on"):
        realtime.prepare("off", processor)


def test_a_processor_outside_the_set_of_the_process_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: {1, 3})
    monkeypatch.setattr(realtime, "take", lambda _processor: pytest.fail("it took something before"))
    with pytest.raises(InputError, match="There is no processor 2 .*: it may use processors 1, 3 only;"):
        realtime.prepare("auto", 2)


def test_an_unknown_real_time_mode_is_refused() -> None:
    with pytest.raises(InputError, match="choose one of auto, on, off"):
        realtime.prepare("yes", None)


def test_freezing_stops_the_garbage_collector() -> None:
    found = output_of("""
realtime.freeze()
say(enabled=gc.isenabled(), frozen=gc.get_freeze_count(), switch=sys.getswitchinterval())
""")
    assert not found["enabled"]
    assert found["frozen"] > 1000
    assert found["switch"] == pytest.approx(realtime.SWITCH_INTERVAL)


@pytest.mark.parametrize(
    ("processors", "count", "expected"),
    [
        ([0], 2, [None, None]),
        ([], 2, [None, None]),
        ([1, 0], 0, []),
        ([1, 0], 1, [1]),
        ([1, 0], 2, [1, 0]),
        ([1, 0], 4, [1, 0, 1, 0]),
        ([3, 2, 1, 0], 2, [3, 2]),
        ([2, 1, 0], 6, [2, 1, 0, 1, 0, 1]),
    ],
)
def test_processors_are_assigned_so_that_the_master_has_its_own(
    monkeypatch: pytest.MonkeyPatch, processors: list[int], count: int, expected: list[int | None]
) -> None:
    monkeypatch.setattr(realtime, "preferred", lambda: processors)
    assert realtime.assign(count) == expected


def test_one_processor_of_each_core_comes_first_and_processor_0_last(monkeypatch: pytest.MonkeyPatch) -> None:
    twins = {0: "0,4", 1: "1,5", 4: "0,4", 5: "1,5"}
    monkeypatch.setattr(realtime, "first_line", lambda path: twins[int(path.parts[-3].removeprefix("cpu"))])
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: {0, 1, 4, 5})
    assert realtime.preferred() == [1, 0, 5, 4]


def test_a_finished_process_keeps_its_exit_code_when_late_signals_arrive() -> None:
    late = child("""
import signal
from common.host.stopping import Stopper
class Late:
    def __del__(self): os.kill(os.getpid(), signal.SIGTERM)
stopping = Stopper()
os.kill(os.getpid(), signal.SIGTERM)
assert stopping() == 'stopped by the user (SIGTERM).'
stopping.ignore()
late = Late()
sys.late = late  # until the interpreter itself is taken down
sys.exit(3)
""")
    assert late.returncode == 3, late.stderr
