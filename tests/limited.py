"""Runs a command for a limited time and leaves nothing of it: `python3 -m tests.limited NAME SECONDS COMMAND …`.

The exit code is the command's; 124 where its time ran out, with a sentence that says so. Then the interpreters in it
write where their threads stand before they are killed. Processes that the command leaves behind, in sessions of their
own too, are named and killed: this process adopts them. Needs nothing but Python, because it also limits the set-up.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

RAN_OUT = 124  # as `timeout` of the GNU core utilities has it
PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36
LAST_WORDS_S = 5.0  # for the stacks of a process that is told to abort
ROUNDS, ROUND_S = 50, 0.1  # children of what was killed come to light when it is gone
SHOWN = 160  # characters of a command line
GRACE_S = 3.0  # for processes that end because what started them has ended


class Left(NamedTuple):
    """A process that runs: its number and its command line."""

    pid: int
    words: str

    def __str__(self) -> str:
        return f"{self.pid} ({self.words[:SHOWN]})"


def adopt() -> None:
    """From now on orphans among the descendants of this process become its children, on Linux."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def children(pid: int) -> Iterator[int]:
    """Numbers of the processes whose parent is `pid`; none where there is no /proc."""
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        with contextlib.suppress(OSError):  # a thread that has ended meanwhile
            yield from map(int, path.read_text().split())


def look(pid: int) -> Left | None:
    """A process, None where it has ended, with or without anybody to hear of it."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        words = Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace")
    except OSError:
        return None
    return None if state in ("Z", "X") else Left(pid, words.replace("\0", " ").strip())


def descendants(pid: int) -> list[Left]:
    """All running processes below `pid`, parents first."""
    found: list[Left] = []
    for child in children(pid):
        process = look(child)
        if process is not None:
            found.append(process)
        found += descendants(child)
    return found


def end(running: Callable[[], list[Left]], grace: float = GRACE_S) -> list[Left]:
    """Kill what is still running after `grace` s, and what comes to light by that; what it was, each once."""
    deadline = time.monotonic() + grace
    while running() and time.monotonic() < deadline:
        time.sleep(0.02)
    killed: dict[int, Left] = {}
    for _ in range(ROUNDS):
        left = running()
        if not left:
            break
        for process in left:
            killed.setdefault(process.pid, process)
            with contextlib.suppress(OSError):
                os.kill(process.pid, signal.SIGKILL)
        time.sleep(ROUND_S)
    return list(killed.values())


def die_with_parent() -> None:
    """Kill this process when the one that started it is gone, on Linux."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


def stop(process: subprocess.Popen[bytes]) -> None:
    """End a command whose time has run out; pytest writes the stacks of its threads when it is told to abort."""
    for one in descendants(os.getpid()):
        if "pytest" in one.words:
            with contextlib.suppress(OSError):
                os.kill(one.pid, signal.SIGABRT)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(LAST_WORDS_S)


def run(name: str, seconds: float, words: list[str]) -> int:
    """Run a command to its end or that of its time; its exit code."""
    adopt()
    # this process has one thread, so that the child may call Python before it becomes the command
    process = subprocess.Popen(words, stdin=subprocess.DEVNULL, preexec_fn=die_with_parent)  # noqa: PLW1509
    try:
        code = process.wait(seconds)
    except subprocess.TimeoutExpired:
        say(f"{name}: not done after {seconds:g} s")
        stop(process)
        end(lambda: descendants(os.getpid()), 0.0)
        return RAN_OUT
    left = end(lambda: descendants(os.getpid()))
    if left:
        say(f"{name}: killed what was left: {', '.join(map(str, left))}")
    return code if code >= 0 else 128 - code


def say(text: str) -> None:
    """A line for whoever reads the log."""
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


def main() -> int:
    """Entry of the command."""
    if len(sys.argv) < 4:
        say("usage: python3 -m tests.limited NAME SECONDS COMMAND ...")
        return 2
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        return run(sys.argv[1], float(sys.argv[2]), sys.argv[3:])
    finally:
        end(lambda: descendants(os.getpid()), 0.0)


if __name__ == "__main__":
    sys.exit(main())
