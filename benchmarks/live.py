"""What a live view costs: late ticks of whole tests with it and without, in turns, and the processor time it takes.

With a browser the page is open in a headless Chromium on the same machine, which draws in software: more than a view
on a desk costs. The tests go on where a busy machine holds a laboratory up: late ticks are counted and end nothing.
Each test has a bare timing loop beside it, whose late ticks are those of the machine: what is held against each other
is the rest.
"""

from __future__ import annotations

import contextlib
import os
import random
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.result import Figure
from common.recording.reader import MACHINES, read
from tests.browser import chromium, open_page
from tests.helpers import patient

ROOT = Path(__file__).resolve().parent.parent
SECONDS = 20.0
REPEATS = 5
MOST = 0.05  # percentage points of late ticks
WITHOUT, VIEW, BROWSER = "without", "--live", "--live and a browser"
KNOWN = ("master.priority", "bare_loop.ticks", "bare_loop.late")
URL = re.compile(r"live view: (http://\S+)")
TIME = re.compile(r"t +([\d.]+)/")


class Test(NamedTuple):
    """One test: late ticks of it and of the bare loop (%), real-time priority, the view's part of a processor (%)."""

    late: float
    beside: float
    priority: bool
    share: float


def run() -> list[Figure]:
    """All kinds of tests in turns, their order drawn anew each time."""
    kinds = [WITHOUT, VIEW, *([BROWSER] if chromium() else [])]
    order, draw = [], random.Random(1)  # noqa: S311 - no secret
    for _ in range(REPEATS):
        order += draw.sample(kinds, len(kinds))
    tests: dict[str, list[Test]] = {kind: [] for kind in kinds}
    for kind in order:
        tests[kind].append(played(kind))
        sys.stderr.write(f"{kind}: {tests[kind][-1]}\n")
    return [figure for kind in kinds for figure in figures(kind, tests[kind], tests[WITHOUT])]


def played(kind: str) -> Test:
    """One test of a kind."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        words = [sys.executable, "-m", "rths", "run", str(patient(Path(folder))), "--duration", str(SECONDS)]
        words += ["-o", str(path), *(["--live"] if kind != WITHOUT else [])]
        with subprocess.Popen(
            words, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        ) as process:
            share = watched(process, path, browser=kind == BROWSER)
        if process.returncode:
            raise RuntimeError(f"the test ended with exit code {process.returncode}")
        recording = read(path)
    machines = {
        name: float(machine) for name, machine in recording.metadata[MACHINES].items() if name in KNOWN
    }
    late = 100.0 * float(np.mean(recording.columns["latency"]["deadline_missed"]))
    bare = 100.0 * machines["bare_loop.late"] / (machines["bare_loop.ticks"] + machines["bare_loop.late"])
    return Test(late, bare, machines["master.priority"] > 0, share)


def watched(process: subprocess.Popen[str], path: Path, *, browser: bool) -> float:
    """Read what a test says to its end; the view's share of a processor between its first and last line of progress."""
    marks: list[tuple[float, float]] = []
    assert process.stderr is not None  # noqa: S101 - it is a pipe
    with contextlib.ExitStack() as pages:
        for line in process.stderr:
            if (found := URL.match(line)) and browser:
                pages.enter_context(open_page(found[1]))
            if found := TIME.match(line):
                marks.append((float(found[1]), seconds_of(path)))
    steady = [mark for mark in marks if mark[0] > 1.0]
    (begin, before), (end, after) = steady[0], steady[-1]
    return 100.0 * (after - before) / (end - begin)


def seconds_of(path: Path) -> float:
    """Processor time of the view of a recording so far, s; 0 where there is none."""
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            words = (folder / "cmdline").read_bytes().split(b"\0")
            if b"rths.live" in words and os.fsencode(path) in words:
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
                return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def figures(kind: str, tests: list[Test], without: list[Test]) -> list[Figure]:
    """Late ticks of one kind of test, and those beyond the bare loop's held against the tests without in each turn."""
    late = [test.late for test in tests]
    found = [Figure(f"late ticks, {kind}", "%", min(late), statistics.median(late))]
    if kind == WITHOUT:
        return found
    beyond = [
        (test.late - test.beside) - (other.late - other.beside)
        for test, other in zip(tests, without, strict=True)
    ]
    middle = statistics.median(beyond)
    met = middle <= MOST if all(test.priority for test in (*tests, *without)) else None
    shares = [test.share for test in tests]
    return [
        *found,
        Figure(f"late ticks, {kind}, beyond without", "points", min(beyond), middle, f"≤ {MOST}", met),
        Figure(f"processor of the view, {kind}", "% of one", min(shares), statistics.median(shares)),
    ]
