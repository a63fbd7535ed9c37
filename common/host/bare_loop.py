"""A bare timing loop in a process of its own, to tell a slow machine from a slow program.

`python -m common.host.bare_loop INTERVAL_NS [--priority N] [--processor N]` says "ready", sleeps to multiples of the
interval from its start until its standard input ends, and prints what it found as one line of JSON. It does
nothing else, so a tick that it misses was missed by the machine. `BareLoop` starts it beside a test.

A tick that woke within its interval is one of `ticks`; one that woke a whole interval or more after its time is
`late`, as are those whose time passed meanwhile: they are skipped, not caught up. A percentile is the lateness
that at least that share of both kinds did not exceed, in bins of `resolution`, rounded up; beyond the bins it
is the exact maximum. Times in s.
"""

from __future__ import annotations

import os
import select
import sys
import time
from array import array

TYPE_CHECKING = False  # `typing` is not worth its time here: this file is started beside a test
if TYPE_CHECKING:
    import argparse
    import subprocess

    from common.host.realtime import Granted

BIN_NS = 1000  # 1 µs: the lateness that matters is tens of µs
BINS = 20_000  # 20 ms: what is later is told apart by the maximum only
PERCENTILES = (("p50", 500), ("p90", 900), ("p99", 990), ("p99.9", 999))  # per mille
# s that `stop` waits for the last line. The process prints it within milliseconds; 2 s allow for pauses of the machine
# of 0.5 s, the longest that were seen (common/plan/patience.py), four times over.
PATIENCE = 2.0


class Lateness:
    """Histogram of how late ticks woke."""

    def __init__(self, interval_ns: int) -> None:
        self._interval_ns = interval_ns
        self._bins = array("Q", bytes(8 * (BINS + 1)))  # the last one holds all beyond
        self._most_ns = 0
        self._ticks = 0
        self._late = 0

    def woke(self, late_ns: int) -> int:
        """Count a tick that woke `late_ns` after its time, and return by how many ticks to move on.

        The next tick is the first whose time has not passed by a whole interval; those before it count as late.
        """
        self._most_ns = max(self._most_ns, late_ns)
        behind = late_ns // self._interval_ns
        self._late += behind
        self._ticks += 1
        within = min(behind, BINS * BIN_NS // self._interval_ns)  # of the missed, those that may fit the bins
        self._bins[BINS] += behind - within
        for missed in range(behind - within, behind + 1):
            self._bins[min((late_ns - missed * self._interval_ns) // BIN_NS, BINS)] += 1
        return behind + 1

    def percentile(self, per_mille: int) -> float:
        """The lateness (s) that `per_mille` thousandths of all ticks did not exceed."""
        wanted = -(-(self._ticks + self._late) * per_mille // 1000)
        passed = 0
        for place in range(BINS):
            passed += self._bins[place]
            if passed >= wanted:
                return min((place + 1) * BIN_NS, self._most_ns) / 1e9
        return self._most_ns / 1e9

    def values(self) -> dict[str, float]:
        """The results that the loop prints at its end; times in s."""
        return {
            "ticks": self._ticks,
            "late": self._late,
            "interval": self._interval_ns / 1e9,
            **{name: self.percentile(per_mille) for name, per_mille in PERCENTILES},
            "max": self._most_ns / 1e9,
            "resolution": BIN_NS / 1e9,
        }


def loop(interval_ns: int) -> Lateness:
    """Tick until standard input ends, at least once; return the histogram of the lateness."""
    lateness = Lateness(interval_ns)
    asked = select.poll()
    asked.register(0, select.POLLIN)
    now, sleep = time.monotonic_ns, time.sleep
    due = now() + interval_ns
    while True:
        sleep(max(due - now(), 0) * 1e-9)
        due += interval_ns * lateness.woke(max(now() - due, 0))
        if asked.poll(0) and not os.read(0, 4096):
            return lateness


def shape(priority: int, processor: int) -> dict[str, float]:
    """Set priority and processor, or keep the parent's where that is refused; return those that hold afterwards."""
    try:
        with open("/proc/self/timerslack_ns", "w") as slack:  # noqa: PTH123 - pathlib is not worth its time here
            slack.write("1")
    except OSError:
        pass  # not Linux: timers are as they are
    if sys.platform != "linux":
        return {"priority": 0, "processor": -1}
    try:
        policy = os.SCHED_FIFO if priority else os.SCHED_OTHER
        os.sched_setscheduler(0, policy, os.sched_param(priority))
    except OSError:
        pass
    try:
        if processor >= 0:
            os.sched_setaffinity(0, {processor})
    except OSError:
        processor = -1
    return {"priority": os.sched_getparam(0).sched_priority, "processor": processor}


def arguments() -> argparse.Namespace:
    """The command line."""
    import argparse

    parser = argparse.ArgumentParser(
        prog="python -m common.host.bare_loop", description="A bare timing loop."
    )
    parser.add_argument("interval_ns", type=int, metavar="INTERVAL_NS")
    parser.add_argument("--priority", type=int, default=0, metavar="N", help="SCHED_FIFO priority (0: none)")
    parser.add_argument("--processor", type=int, default=-1, metavar="N", help="processor (-1: any)")
    found = parser.parse_args()
    if found.interval_ns < BIN_NS:
        parser.error(f"INTERVAL_NS {found.interval_ns} is too short: give {BIN_NS} ns or more.")
    return found


def main() -> None:
    """Entry of the process."""
    import gc
    import json

    args = arguments()
    place = shape(args.priority, args.processor)
    gc.disable()
    os.write(1, b"ready\n")
    found = loop(args.interval_ns)
    os.write(1, (json.dumps(found.values() | place) + "\n").encode())


class BareLoop:
    """The loop as a child process of a test: `start` starts it, `stop` ends it and returns its values.

    Neither method raises an exception or starts a thread.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def start(self, interval_ns: int, granted: Granted) -> None:
        """Start it on the processor that a process was granted, at one priority above that process.

        At the same priority, a slow program would delay the bare loop and so look like a slow machine. The loop takes
        some 10 µs per interval. Where the higher priority is refused, it keeps that of the process which starts it.
        """
        self.stop()
        self.spawn(interval_ns, granted.priority + 1 if granted.priority else 0, granted.processor)

    def spawn(self, interval_ns: int, priority: int, processor: int) -> None:
        """Start it at a priority (0: ordinary) on a processor (-1: any that this process may use).

        The file is run by itself, without the packages that Python imports at its start, and in a session of its own,
        so that Ctrl-C does not reach it. It ends when its standard input closes, which also happens if this process
        is killed.
        """
        import subprocess

        words = [str(interval_ns), "--priority", str(priority), "--processor", str(processor)]
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-S", __file__, *words],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )
        except OSError:
            self._process = None

    def stop(self) -> dict[str, float]:
        """End it within `PATIENCE` s and return its values; an empty dict where it failed or was not started."""
        import json
        import subprocess

        process, self._process = self._process, None
        if process is None:
            return {}
        said = b""
        try:
            said, _ = process.communicate(timeout=PATIENCE)  # closes its standard input
        except (OSError, ValueError, subprocess.SubprocessError):
            pass
        finally:
            _end(process)
        try:
            found = json.loads(said.splitlines()[-1])
            return {str(name): float(value) for name, value in found.items()}
        except (ValueError, IndexError, AttributeError, TypeError):
            return {}


def _end(process: subprocess.Popen[bytes]) -> None:
    """Kill a process that still runs, and close its pipes."""
    if process.poll() is None:
        process.kill()
        process.wait()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            pipe.close()


if __name__ == "__main__":
    main()
