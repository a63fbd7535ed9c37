"""The clocks of this machine: resolution, cost of a reading, drift, and whether they are synchronised."""

from __future__ import annotations

import ctypes
import itertools
import sys
import time

READS = 2000  # of the clock in a row: about 0.1 ms of work, long against the finest step of a clock
STA_UNSYNC = 0x0040  # status bit of adjtimex(2)
UNSET = 16_000_000  # µs; the kernel's value for an error that no program has set (NTP_PHASE_LIMIT)


class Timex(ctypes.Structure):
    """The first fields of the kernel's struct timex; `rest` is longer than what follows them."""

    _fields_ = (
        ("modes", ctypes.c_uint),
        ("offset", ctypes.c_long),
        ("freq", ctypes.c_long),
        ("maxerror", ctypes.c_long),
        ("esterror", ctypes.c_long),
        ("status", ctypes.c_int),
        ("rest", ctypes.c_long * 32),
    )


class ClockWatch:
    """Compares the clocks between its start and `values()`."""

    def __init__(self) -> None:
        self._before = readings()

    def values(self) -> dict[str, float | bool]:
        """Resolution and reading time of the monotonic clock, step and slew of the clocks, s; the kernel's report."""
        after = readings()
        monotonic, wall, raw = (b - a for a, b in zip(self._before, after, strict=True))
        return {
            **fineness(),
            "wall_step": (wall - monotonic) / 1e9,
            "slew": (monotonic - raw) / max(raw, 1),
            **synchronisation(),
        }


def readings() -> tuple[int, int, int]:
    """Monotonic, wall and raw monotonic clock at one moment, ns: the fastest of 20 readings of all three."""
    found: list[tuple[int, tuple[int, int, int]]] = []
    for _ in range(20):
        before = raw_ns()
        monotonic, wall = time.monotonic_ns(), time.time_ns()
        after = raw_ns()
        found.append((after - before, (monotonic, wall, (before + after) // 2)))
    return min(found)[1]


def raw_ns() -> int:
    """The raw clock, which is never adjusted, ns; the monotonic clock where there is none."""
    if sys.platform == "linux":
        return time.clock_gettime_ns(time.CLOCK_MONOTONIC_RAW)
    return time.monotonic_ns()


def fineness() -> dict[str, float]:
    """Smallest step that the monotonic clock was seen to take, and the time it takes to read it, s."""
    times = [time.monotonic_ns() for _ in range(READS)]
    steps = [b - a for a, b in itertools.pairwise(times) if b > a]
    return {
        "resolution": min(steps, default=times[-1] - times[0]) / 1e9,
        "read_time": (times[-1] - times[0]) / (READS - 1) / 1e9,
    }


def synchronisation() -> dict[str, float | bool]:
    """Whether the kernel reports a clock synchronised by NTP or PTP, and its error, s; empty if it does not say."""
    if sys.platform != "linux":
        return {}
    timex = Timex()
    if ctypes.CDLL(None, use_errno=True).adjtimex(ctypes.byref(timex)) < 0:
        return {}
    found: dict[str, float | bool] = {"synchronised": not timex.status & STA_UNSYNC}
    if timex.esterror < UNSET:
        found["estimated_error"] = timex.esterror * 1e-6
    return found
