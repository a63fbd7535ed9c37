"""Measures what the host did to a process while it ran, and describes the host; none of it needs a privilege.

`Watch` counts between its construction and `values()`. A count that the kernel does not offer, in a container or
on another system than Linux, is left out rather than given as zero.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Iterator
from pathlib import Path

PROC, SYS = Path("/proc"), Path("/sys")
CGROUPS = SYS / "fs/cgroup"
POLICIES = {0: "other", 1: "fifo", 2: "rr", 3: "batch", 5: "idle", 6: "deadline"}
STARTED = 19  # index of the start time in /proc/PID/stat, counted from the state, which follows the name
ENDED = ("Z", "X")  # states of a process that has ended: not yet collected by its parent, or dead
RESET_ON_FORK = 0x40000000  # Linux's SCHED_RESET_ON_FORK, a flag in the number of the policy
USER, NICE, SYSTEM, _IDLE, _IOWAIT, IRQ, SOFTIRQ, STEAL = range(8)  # columns of /proc/stat
BUSY = (USER, NICE, SYSTEM, IRQ, SOFTIRQ)  # guests are counted in `user` already


class Watch:
    """Counts what the host does from its construction on."""

    def __init__(self) -> None:
        self._began = time.monotonic()
        self._before = counters()

    def values(self) -> dict[str, float]:
        """Differences since the construction: seconds, shares of all processors' time, counts of this process."""
        seconds = max(time.monotonic() - self._began, 1e-9)
        after = counters()
        passed = {name: after[name] - self._before[name] for name in after if name in self._before}
        stolen = [passed.pop(name) for name in sorted(passed) if name.startswith("stolen_s_of_")]
        processors = len(stolen) or os.cpu_count() or 1
        found = {"seconds": seconds, "processors": float(processors)}
        if "busy_s" in passed:
            found["busy_share"] = passed.pop("busy_s") / (seconds * processors)
            found["stolen_share"] = passed["stolen_s"] / (seconds * processors)
            found["stolen_share_of_worst"] = max(stolen, default=0.0) / seconds
        return found | passed | load()


def counters() -> dict[str, float]:
    """All counters that only grow, by name; times in s."""
    found: dict[str, float] = {}
    for read in (processor_times, switches_and_faults, pressure, throttling):
        try:
            found |= read()
        except (OSError, ValueError, IndexError, ImportError):
            continue  # not offered here
    return found


def processor_times() -> dict[str, float]:
    """Busy and stolen time of all processors, and stolen time of each, s; resolution 10 ms."""
    unit = 1.0 / os.sysconf("SC_CLK_TCK")
    found: dict[str, float] = {}
    for line in (PROC / "stat").read_text().splitlines():
        name, *numbers = line.split()
        if not name.startswith("cpu"):
            break
        columns = [int(number) * unit for number in numbers]
        if name == "cpu":
            found["busy_s"] = sum(columns[place] for place in BUSY)
            found["stolen_s"] = columns[STEAL]
        else:
            found[f"stolen_s_of_{name}"] = columns[STEAL]
    return found


def switches_and_faults() -> dict[str, float]:
    """How often this process, with all its threads, gave up or lost its processor, and waited for memory."""
    import resource

    usage = resource.getrusage(resource.RUSAGE_SELF)
    return {
        "voluntary_switches": float(usage.ru_nvcsw),
        "involuntary_switches": float(usage.ru_nivcsw),
        "minor_faults": float(usage.ru_minflt),
        "major_faults": float(usage.ru_majflt),
    }


def pressure() -> dict[str, float]:
    """How long some task of the host waited for a processor, s."""
    some = (PROC / "pressure/cpu").read_text().splitlines()[0]
    return {"waiting_s": int(some.rsplit("total=", 1)[1]) * 1e-6}


def throttling() -> dict[str, float]:
    """How often and how long a quota of this process's control groups kept it from running."""
    found: dict[str, float] = {}
    for folder in groups("cpu"):
        try:
            text = (folder / "cpu.stat").read_text()
        except OSError:
            continue
        facts = {name: int(number) for name, number in map(str.split, text.splitlines())}
        if "nr_throttled" in facts:
            seconds = facts.get("throttled_usec", 0) * 1e-6 + facts.get("throttled_time", 0) * 1e-9
            found["throttled"] = found.get("throttled", 0.0) + facts["nr_throttled"]
            found["throttled_s"] = found.get("throttled_s", 0.0) + seconds
    return found


def groups(controller: str) -> Iterator[Path]:
    """Folders of the control groups this process is in, version 1 or 2, from its own up to the top."""
    for line in (PROC / "self/cgroup").read_text().splitlines():
        _, names, path = line.split(":", 2)
        if names and controller not in names.split(","):
            continue
        tops = (CGROUPS / names,) if names else (CGROUPS, CGROUPS / "unified")
        for top in tops:
            folder = top / path.lstrip("/")
            inside = [folder, *folder.parents] if ".." not in path else [top]  # a namespace hides the rest
            yield from (place for place in inside if place.is_relative_to(top) and place.is_dir())


def load() -> dict[str, float]:
    """Mean number of tasks that ran or wanted to, over the last minute."""
    try:
        return {"load": os.getloadavg()[0]}
    except OSError:
        return {}


def spare_memory() -> int | None:
    """Memory this process may still take, bytes, by the host and by its control groups; None where unknown."""
    spare: list[int] = []
    try:
        facts = dict(line.split(":") for line in (PROC / "meminfo").read_text().splitlines())
        spare.append(int(facts["MemAvailable"].split()[0]) * 1024)
        for folder in groups("memory"):
            for most, used in (
                ("memory.max", "memory.current"),
                ("memory.limit_in_bytes", "memory.usage_in_bytes"),
            ):
                limit = first_line(folder / most)
                if limit.isdigit():
                    spare.append(int(limit) - int(first_line(folder / used)))
    except (OSError, ValueError, KeyError):
        pass
    return min(spare, default=None)


def began(pid: int) -> float | None:
    """When a process was started (Unix time, s), 0 where the system does not say; None where it does not run."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return None
    except PermissionError:
        pass  # another user's
    try:
        state, *facts = (PROC / str(pid) / "stat").read_text().rsplit(")", 1)[1].split()
        if state in ENDED:
            return None
        ticks = int(facts[STARTED - 1])
        since = next(line for line in (PROC / "stat").read_text().splitlines() if line.startswith("btime"))
    except (OSError, StopIteration, IndexError, ValueError):
        return 0.0
    return float(since.split()[1]) + ticks / os.sysconf("SC_CLK_TCK")


def scheduler_name(pid: int = 0) -> str:
    """How a process is scheduled: 'other', 'fifo 50'; 'unknown' where the system does not say."""
    if sys.platform != "linux":
        return "unknown"
    try:
        policy = os.sched_getscheduler(pid) & ~RESET_ON_FORK
        priority = os.sched_getparam(pid).sched_priority
    except OSError:
        return "unknown"
    name = POLICIES.get(policy, f"policy {policy}")
    return f"{name} {priority}" if priority else name


def facts() -> dict[str, str]:
    """What kind of host this is, as far as it says so."""
    found = {
        "system": f"{platform.system()} {platform.release()}",
        "preemption": preemption(),
        "clocksource": first_line(SYS / "devices/system/clocksource/clocksource0/current_clocksource"),
        "governor": governors(),
        "processor": cpuinfo("model name"),
        "hypervisor": hypervisor(),
        "isolated_processors": first_line(SYS / "devices/system/cpu/isolated"),
    }
    return {name: text for name, text in found.items() if text}


def preemption() -> str:
    """What may interrupt the kernel: 'PREEMPT_RT' for the one made for real time."""
    version = platform.version()
    if first_line(SYS / "kernel/realtime") == "1" or "PREEMPT_RT" in version:
        return "PREEMPT_RT"
    return next((word for word in version.split() if word.startswith("PREEMPT")), "")


def governors() -> str:
    """The governors that set the processors' frequency; 'performance' keeps it at its maximum."""
    found = {first_line(path) for path in (SYS / "devices/system/cpu").glob("cpu*/cpufreq/scaling_governor")}
    return ", ".join(sorted(found - {""}))


def hypervisor() -> str:
    """The hypervisor of a virtual machine, empty on a physical one."""
    if "hypervisor" not in cpuinfo("flags").split():
        return first_line(SYS / "hypervisor/type")
    return first_line(SYS / "hypervisor/type") or first_line(SYS / "class/dmi/id/sys_vendor") or "unnamed"


def cpuinfo(name: str) -> str:
    """A value of the first processor in /proc/cpuinfo, empty where there is none."""
    try:
        with (PROC / "cpuinfo").open() as lines:
            return next((line.split(":", 1)[1].strip() for line in lines if line.startswith(name)), "")
    except (OSError, IndexError):
        return ""


def first_line(path: Path) -> str:
    """The first line of a file of the kernel, empty where it cannot be read."""
    try:
        return path.read_text().split("\n", 1)[0].strip()
    except (OSError, UnicodeDecodeError):
        return ""
