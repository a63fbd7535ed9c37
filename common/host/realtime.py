"""Prepares the calling process for real time: priority, processor, memory, timers, garbage collection.

`prepare` must be called before the link opens and before any other thread starts: threads inherit priority and
processor from the one that starts them, and a thread that runs already keeps what it has. Child processes inherit
them too; one that is not to run at this priority has to lower it itself.
"""

from __future__ import annotations

import ctypes
import errno
import gc
import os
import sys
from pathlib import Path
from typing import NamedTuple

from common.errors import InputError
from common.host.machine import first_line, spare_memory

MODES = ("auto", "on", "off")

# One below the 50 (half of the kernel's range) at which Linux runs its interrupt threads under PREEMPT_RT: the
# frames that the loop waits for pass through them. Above everything ordinary, and above the kernel's threads at 1.
PRIORITY = 49

SWITCH_INTERVAL = (
    1e-4  # s; at Python's 5 ms one busy thread costs the loop more than an interval per hand-over
)
PR_SET_TIMERSLACK = 29
give_way = getattr(
    os, "sched_yield", lambda: None
)  # lets others run on this processor; not every system has it
MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT = 1, 2, 4
# Share of the spare memory that is locked at most. Locked memory cannot be paged out, so with more of it locked the
# kernel might run out of memory and kill the process; half leaves as much again for growth and other processes.
MOST_OF_MEMORY = 0.5

WHERE_LIMITS = "in /etc/security/limits.d/"


class Granted(NamedTuple):
    """What a process was given."""

    priority: int  # SCHED_FIFO priority, 0 where the ordinary scheduler stays
    processor: int  # the one processor the process is bound to, -1 where free
    memory_locked: bool
    missing: tuple[str, ...]  # one sentence per thing that could not be had: what, why, what to do

    def values(self) -> dict[str, float]:
        """The same as numbers, for the recording."""
        return {
            "priority": float(self.priority),
            "processor": float(self.processor),
            "memory_locked": float(self.memory_locked),
            "missing": float(len(self.missing)),
        }


NOTHING = Granted(0, -1, False, ())


def prepare(mode: str, processor: int | None) -> Granted:
    """Prepare this process for real time and return what it was given.

    'off' takes only what needs no privilege and changes no scheduling. `processor` None leaves the process free.

    Raises:
        InputError: there is no such mode, this process may not use the processor or it is given with 'off',
            or the mode is 'on' and something could not be had.
    """
    if mode not in MODES:
        raise InputError(f"There is no real-time mode '{mode}': choose one of {', '.join(MODES)}.")
    if processor is not None and mode == "off":
        raise InputError("--processor needs --rt auto or on: with off the process is bound to none.")
    if processor is not None and sys.platform == "linux":
        allowed = os.sched_getaffinity(0)
        if processor not in allowed:
            raise InputError(
                f"There is no processor {processor} for this process: it may use {listed(allowed)} only; "
                "choose one of these, or widen its set (taskset, docker --cpuset-cpus)."
            )
    tighten_timers()
    hand_over_quickly()
    if mode == "off":
        return NOTHING
    granted = take(processor)
    if mode == "on" and granted.missing:
        raise InputError(" ".join(granted.missing))
    return granted


def take(processor: int | None) -> Granted:
    """Request each real-time setting, and return those that were granted."""
    if sys.platform != "linux":
        return NOTHING._replace(
            missing=(
                f"No real-time priority: rths sets it on Linux only, this is {sys.platform}; use Linux.",
            )
        )
    # this takes tens of ms, so it runs at ordinary priority: at real-time priority other laboratories would wait for it
    gc.collect()
    gc.freeze()
    not_locked = lock_memory()
    priority, no_priority = raise_priority()
    bound, not_bound = (-1, "") if processor is None else bind(processor, priority)
    missing = tuple(sentence for sentence in (no_priority, not_bound, not_locked) if sentence)
    return Granted(priority, bound, not not_locked, missing)


def raise_priority() -> tuple[int, str]:
    """Request SCHED_FIFO for this thread and those it starts; return the priority, or 0 and a sentence why not.

    Set without SCHED_RESET_ON_FORK, which would send every new thread back to the ordinary scheduler.
    """
    limit = raised("RLIMIT_RTPRIO", PRIORITY)
    refusal = OSError()
    for priority in sorted({PRIORITY, max(1, min(PRIORITY, limit))}, reverse=True):
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        except OSError as error:
            refusal = error
        else:
            return priority, ""
    if refusal.errno == errno.EPERM and limit == 0:
        return 0, (
            "No real-time priority: the limit RLIMIT_RTPRIO is 0; run as root, or give the user "
            f"'rtprio 95' {WHERE_LIMITS}, or --cap-add SYS_NICE in a container."
        )
    return 0, (
        f"No real-time priority: the kernel refuses it ({refusal.strerror}) though the limit RLIMIT_RTPRIO is "
        f"{limit}; give the control group real-time time (cpu.rt_runtime_us, docker --cpu-rt-runtime)."
    )


def bind(processor: int, priority: int) -> tuple[int, str]:
    """Bind this thread and those it starts to one processor; return it, or -1 and a sentence why not."""
    if priority == 0:
        # An ordinary process that is bound waits for whoever holds its processor while another stands idle.
        return -1, (
            f"Not bound to processor {processor}: without a real-time priority that would delay rather than "
            "help; get the priority first."
        )
    allowed = os.sched_getaffinity(0)
    if processor not in allowed:
        return -1, (
            f"Not bound to processor {processor}: this process may use {listed(allowed)} only; "
            "choose one of these, or widen its set (taskset, docker --cpuset-cpus)."
        )
    try:
        os.sched_setaffinity(0, {processor})
    except OSError as error:
        return -1, f"Not bound to processor {processor}: {error.strerror}; leave it free, or choose another."
    return processor, ""


def lock_memory() -> str:
    """Lock the memory of the process against page faults; return a sentence why not, or an empty text.

    A page is locked when it is first used: to lock all that is mapped at once, unused stacks and buffers too, would
    take 400 MB per process and half a second. Under a limit nothing is locked, because locked pages count against it
    and the first allocation beyond it would fail.
    """
    limit = raised("RLIMIT_MEMLOCK", -1)
    libc = ctypes.CDLL(None, use_errno=True)
    if limit != -1 and not exempt(libc):
        return (
            f"Memory is not locked: the limit RLIMIT_MEMLOCK is {limit // 1024} KiB, and allocations beyond it "
            f"would fail; run as root, or give the user 'memlock unlimited' {WHERE_LIMITS}, or --cap-add "
            "IPC_LOCK in a container."
        )
    needed, spare = resident(), spare_memory()
    if spare is not None and needed > MOST_OF_MEMORY * spare:
        return (
            f"Memory is not locked: the process holds {needed >> 20} MiB and {spare >> 20} MiB are spare; "
            "give the machine or its container more memory."
        )
    if libc.mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) != 0:
        return f"Memory is not locked: {os.strerror(ctypes.get_errno())}; run as root, or free memory."
    return ""


def raised(name: str, wanted: int) -> int:
    """Raise a limit of this process as far as permitted towards `wanted` (-1: none), and return its new value."""
    import resource

    which = getattr(resource, name)
    soft, hard = resource.getrlimit(which)
    if reaches(soft, wanted):
        return soft
    for target in ((wanted, hard if reaches(hard, wanted) else wanted), (hard, hard)):
        try:
            resource.setrlimit(which, target)
            break
        except (OSError, ValueError):  # above the hard limit, for which there is no privilege
            continue
    return resource.getrlimit(which)[0]


def reaches(limit: int, wanted: int) -> bool:
    """Whether a limit allows the wanted value; -1 means no limit in both."""
    return limit == -1 or -1 < wanted <= limit


def exempt(libc: ctypes.CDLL) -> bool:
    """Whether this process may lock memory whatever its limit.

    This is tested by locking a page under a limit of 0, because /proc also shows capabilities that hold inside a
    namespace only.
    """
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    page = ctypes.create_string_buffer(1)
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (0, hard))
    try:
        may = bool(libc.mlock(page, ctypes.c_size_t(1)) == 0)
        if may:
            libc.munlock(page, ctypes.c_size_t(1))
    finally:
        resource.setrlimit(resource.RLIMIT_MEMLOCK, (soft, hard))
    return may


def resident() -> int:
    """Bytes of the process that are in memory and would be locked; 0 where unknown."""
    pages = first_line(Path("/proc/self/statm")).split()
    return int(pages[1]) * os.sysconf("SC_PAGE_SIZE") if pages else 0


def tighten_timers() -> None:
    """On Linux, let the kernel delay timer wake-ups by 1 ns at most, in place of 50 µs, to combine them with others."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0)


def hand_over_quickly() -> None:
    """Shorten the time after which a thread hands the interpreter over to one that waits for it."""
    sys.setswitchinterval(SWITCH_INTERVAL)


def freeze() -> None:
    """Keep interpreter and timers from delaying a loop that begins now: garbage is not collected from here on."""
    hand_over_quickly()
    tighten_timers()
    gc.collect()
    gc.freeze()
    gc.disable()


def assign(count: int) -> list[int | None]:
    """Processors for `count` laboratories on this machine, the master's first; None leaves one free.

    Each laboratory gets a different processor where there are enough; with one alone all stay free. With fewer
    processors than laboratories they are shared in turn; from three on the master keeps one to itself.
    """
    processors: list[int | None] = [*preferred()]
    if len(processors) < 2:
        return [None] * count
    kept = 1 if len(processors) >= 3 else 0
    shared = [*processors[1:], *processors[: 1 - kept]]
    return [processors[0], *(shared[place % len(shared)] for place in range(count - 1))][:count]


def preferred() -> list[int]:
    """Allowed processors, best first: one hardware thread of each core before the others, the highest number first.

    Processor 0 comes last among equals, because most interrupts are handled there.
    """
    if sys.platform != "linux":
        return []
    allowed = os.sched_getaffinity(0)
    return sorted(allowed, key=lambda processor: (twin(processor), -processor))


def twin(processor: int) -> int:
    """Index of a processor among the hardware threads of its core, 0 where it is the first or alone."""
    folder = f"/sys/devices/system/cpu/cpu{processor}/topology"
    sharing = first_line(Path(folder) / "thread_siblings_list").replace("-", ",").split(",")
    return sharing.index(str(processor)) if str(processor) in sharing else 0


def listed(processors: set[int]) -> str:
    """Processors in words: 'processors 0, 1'."""
    return f"processor{'s' if len(processors) > 1 else ''} {', '.join(map(str, sorted(processors)))}"
