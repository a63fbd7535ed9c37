"""The description of the host, read from the real kernel and from made-up files."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import time
from pathlib import Path

import pytest

from common.host import machine
from tests.processes import HANG_S

STAT = """cpu  100 10 50 800 5 3 7 40 0 0
cpu0 50 5 25 400 3 2 3 10 0 0
cpu1 50 5 25 400 2 1 4 30 0 0
intr 12345
"""


@pytest.fixture
def kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The files of a made-up kernel, which are empty at first."""
    monkeypatch.setattr(machine, "PROC", tmp_path / "proc")
    monkeypatch.setattr(machine, "SYS", tmp_path / "sys")
    monkeypatch.setattr(machine, "CGROUPS", tmp_path / "sys/fs/cgroup")
    return tmp_path


def write(root: Path, name: str, text: str) -> None:
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    (root / name).write_text(text)


def test_the_real_kernel_gives_plausible_numbers() -> None:
    watch = machine.Watch()
    time.sleep(0.05)
    values = watch.values()
    assert values["seconds"] >= 0.05
    assert values["processors"] == os.cpu_count()
    assert all(type(value) is float for value in values.values())
    if sys.platform == "linux":
        assert 0.0 <= values["stolen_share"] <= 1.0 + 1e-9
        assert values["busy_share"] >= 0.0
        assert values["involuntary_switches"] >= 0.0


def test_stolen_and_busy_time_are_shares_of_all_processors(kernel: Path) -> None:
    write(kernel, "proc/stat", STAT)
    watch = machine.Watch()
    later = STAT.replace("100 10 50 800 5 3 7 40", "110 10 50 850 5 3 7 46").replace("1 4 30", "1 4 36")
    write(kernel, "proc/stat", later)
    values = watch.values()
    unit = 1.0 / os.sysconf("SC_CLK_TCK")
    assert values["stolen_s"] == pytest.approx(6 * unit)
    assert values["stolen_share"] == pytest.approx(6 * unit / (2 * values["seconds"]))
    assert values["stolen_share_of_worst"] == pytest.approx(6 * unit / values["seconds"])
    assert values["busy_share"] == pytest.approx(10 * unit / (2 * values["seconds"]))


def test_figures_that_the_kernel_does_not_offer_are_left_out(kernel: Path) -> None:
    values = machine.Watch().values()
    assert not {"stolen_share", "busy_share", "waiting_s", "throttled_s"} & set(values)
    assert values["major_faults"] >= 0.0
    assert set(machine.facts()) <= {"system", "preemption"}
    assert machine.spare_memory() is None


@pytest.mark.parametrize(
    ("cgroup", "folder", "unit"),
    [
        ("0::/a/b\n", "sys/fs/cgroup/a", "throttled_usec 2500000"),
        ("4:cpu,cpuacct:/a/b\n0::/\n", "sys/fs/cgroup/cpu,cpuacct/a/b", "throttled_time 2500000000"),
        ("0::/../elsewhere\n", "sys/fs/cgroup", "throttled_usec 2500000"),
    ],
)
def test_a_processor_quota_is_found_in_both_cgroup_versions_and_in_parent_groups(
    kernel: Path, cgroup: str, folder: str, unit: str
) -> None:
    write(kernel, "proc/self/cgroup", cgroup)
    write(kernel, f"{folder}/cpu.stat", f"nr_periods 9\nnr_throttled 3\n{unit}\n")
    (kernel / "sys/fs/cgroup/a/b").mkdir(parents=True, exist_ok=True)
    assert machine.throttling() == {"throttled": 3.0, "throttled_s": 2.5}


def test_pressure_is_the_time_for_which_some_task_waited(kernel: Path) -> None:
    write(kernel, "proc/pressure/cpu", "some avg10=0.45 avg60=0.46 avg300=1.85 total=3500000\nfull total=0\n")
    assert machine.pressure() == {"waiting_s": 3.5}


def test_spare_memory_is_the_least_of_host_and_control_groups(kernel: Path) -> None:
    write(kernel, "proc/meminfo", "MemTotal:  4000 kB\nMemAvailable:  2000 kB\n")
    write(kernel, "proc/self/cgroup", "0::/box\n")
    write(kernel, "sys/fs/cgroup/box/memory.max", "max\n")
    assert machine.spare_memory() == 2000 * 1024
    write(kernel, "sys/fs/cgroup/box/memory.max", "1000000\n")
    write(kernel, "sys/fs/cgroup/box/memory.current", "400000\n")
    assert machine.spare_memory() == 600_000


@pytest.mark.parametrize(
    ("realtime", "version", "expected"),
    [
        ("1\n", "#1 SMP", "PREEMPT_RT"),
        ("", "#1 SMP PREEMPT_RT Fri", "PREEMPT_RT"),
        ("", "#1 SMP PREEMPT_DYNAMIC", "PREEMPT_DYNAMIC"),
        ("", "#1 SMP", ""),
    ],
)
def test_a_real_time_kernel_is_recognized(
    kernel: Path, monkeypatch: pytest.MonkeyPatch, realtime: str, version: str, expected: str
) -> None:
    write(kernel, "sys/kernel/realtime", realtime)
    monkeypatch.setattr(platform, "version", lambda: version)
    assert machine.preemption() == expected


def test_facts_name_clock_governor_and_hypervisor(kernel: Path) -> None:
    write(kernel, "proc/cpuinfo", "processor : 0\nmodel name : A Processor\nflags : fpu hypervisor sse\n")
    write(kernel, "sys/devices/system/clocksource/clocksource0/current_clocksource", "kvm-clock\n")
    for processor in range(2):
        write(
            kernel, f"sys/devices/system/cpu/cpu{processor}/cpufreq/scaling_governor", "powersave\nignored\n"
        )
    facts = machine.facts()
    assert facts["clocksource"] == "kvm-clock"
    assert facts["governor"] == "powersave"
    assert facts["processor"] == "A Processor"
    assert facts["hypervisor"] == "unnamed"


@pytest.mark.skipif(sys.platform != "linux", reason="schedulers have these names on Linux")
def test_the_scheduler_of_a_process_is_named() -> None:
    sleeper = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        os.sched_setscheduler(sleeper.pid, os.SCHED_OTHER, os.sched_param(0))
        assert machine.scheduler_name(sleeper.pid) == "other"
        os.sched_setscheduler(sleeper.pid, os.SCHED_BATCH, os.sched_param(0))
        assert machine.scheduler_name(sleeper.pid) == "batch"
    finally:
        sleeper.communicate(timeout=HANG_S)
    assert machine.scheduler_name(sleeper.pid) == "unknown"
