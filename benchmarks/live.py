"""The cost of a live view and of a panel: late ticks of whole tests with and without, in turns, and processor time.

In the tests with a browser the page is open in a headless Chromium on the same machine, which renders in software: that
costs more than a browser on another machine. The plan tolerates late ticks, so that they are counted but end no test.
A bare timing loop runs beside each test; its late ticks are caused by the machine, and only the rest is compared.
"""

from __future__ import annotations

import contextlib
import math
import os
import random
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from playwright.sync_api import Error as PageError

from benchmarks.result import BenchmarkFigure, cost_figure
from benchmarks.whole_test import ROOT, Ending, command, ended_early, ending
from common.recording.run import MACHINES, Run
from tests.browser import chromium, open_page
from tests.helpers import patient

SECONDS, QUICK_S = 20.0, 2.0  # duration of a test
REPEATS = 5  # odd, so that the median is a measured value; twenty tests take about nine minutes
MOST = 0.05  # percentage points of late ticks: 5 of the 10,000 ticks of a test
WITHOUT, VIEW, BROWSER = "without", "--live", "--live and a browser"
PANEL = "rths panel and a browser"
KNOWN = ("master.priority", "bare_loop.ticks", "bare_loop.late")
URL = re.compile(r"(?:live view|panel): (http://\S+)")
TIME = re.compile(r"t +([\d.]+)/")


class Test(NamedTuple):
    """Figures of one test: late ticks of the test and of the bare loop (%), and whether it had real-time priority.

    `share` is the processor time of the view over the time that passed (%), NaN if it could not be measured.
    """

    late: float
    beside: float
    priority: bool
    share: float


class Turn(NamedTuple):
    """How one test ended, and its figures, None if it ended early."""

    ending: Ending
    test: Test | None


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """Run all kinds of tests in turns, in a new random order each time."""
    seconds, repeats = (QUICK_S, 1) if quick else (SECONDS, REPEATS)
    kinds = [WITHOUT, VIEW, *([BROWSER, PANEL] if chromium() and not quick else [])]
    order, draw = [], random.Random(1)  # noqa: S311 - no secret
    for _ in range(repeats):
        order += draw.sample(kinds, len(kinds))
    turns: dict[str, list[Turn]] = {kind: [] for kind in kinds}
    for kind in order:
        turns[kind].append(played(kind, seconds))
        sys.stderr.write(f"{kind}: {turns[kind][-1].test or turns[kind][-1].ending.said}\n")
    return [figure for kind in kinds for figure in figures(kind, turns[kind], turns[WITHOUT])]


def played(kind: str, seconds: float) -> Turn:
    """Run one test of a kind with a duration in s."""
    with tempfile.TemporaryDirectory() as folder:
        path, said = Path(folder) / "a.mcap", Path(folder) / "said"
        words = [str(patient(Path(folder))), "--duration", str(seconds)]
        words += ["--live"] if kind in (VIEW, BROWSER) else []
        with (
            operated() if kind == PANEL else contextlib.nullcontext(),
            subprocess.Popen(
                command(path, *words), cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
            ) as process,
        ):
            try:
                share = watched(process, path, said, browser=kind == BROWSER)
            except PageError as error:  # the test was over before the page had loaded
                process.communicate()
                return Turn(Ending(process.returncode, str(error).splitlines()[0], None), None)
        ended = ending(process.returncode, said.read_text(), path)
    return Turn(ended, facts(ended.run, share) if ended.completed and ended.run is not None else None)


@contextlib.contextmanager
def operated() -> Iterator[None]:
    """A panel that is open in a browser; it finds the test that runs on this machine."""
    words = [sys.executable, "-m", "rths", PANEL.split()[1], "--no-browser"]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None  # noqa: S101 - it is a pipe
        try:
            found = URL.match(process.stdout.readline())
            if found is None:
                raise PageError("The panel has not said where it is.")
            with open_page(found[1]):
                yield
        finally:
            process.terminate()


def facts(recording: Run, share: float) -> Test:
    """The figures of a recorded test."""
    machines = {
        name: float(machine) for name, machine in recording.metadata[MACHINES].items() if name in KNOWN
    }
    late = 100.0 * float(np.mean(recording.columns["latency"]["deadline_missed"]))
    bare = 100.0 * machines["bare_loop.late"] / (machines["bare_loop.ticks"] + machines["bare_loop.late"])
    return Test(late, bare, machines["master.priority"] > 0, share)


def watched(process: subprocess.Popen[str], path: Path, said: Path, *, browser: bool) -> float:
    """Write the output of a running test to `said`; returns the view's processor time over the time passed (%).

    It is measured between the first line of progress after 1 s of the test, when the view has started, and the last;
    NaN if there are no two such lines.
    """
    marks: list[tuple[float, float]] = []
    assert process.stderr is not None  # noqa: S101 - it is a pipe
    with contextlib.ExitStack() as pages, said.open("w") as kept:
        for line in process.stderr:
            kept.write(line)
            if (found := URL.match(line)) and browser:
                pages.enter_context(open_page(found[1]))
            if found := TIME.match(line):
                marks.append((float(found[1]), seconds_of(path)))
    steady = [mark for mark in marks if mark[0] > 1.0]
    if len(steady) < 2:
        return math.nan
    (begin, before), (end, after) = steady[0], steady[-1]
    return 100.0 * (after - before) / (end - begin)


def seconds_of(path: Path) -> float:
    """Processor time that the view of a recording, or a panel, has used so far, s; 0 without one."""
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            words = (folder / "cmdline").read_bytes().split(b"\0")
            view = b"rths.perform.live" in words and os.fsencode(path) in words
            if view or words[1:4] == [b"-m", b"rths", b"panel"]:
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
                return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def figures(kind: str, turns: list[Turn], without: list[Turn]) -> list[BenchmarkFigure]:
    """The late ticks of one kind of test, and their difference from those of the tests without a view."""
    early = ended_early(f"test, {kind}", [turn.ending for turn in turns])
    tests = [turn.test for turn in turns if turn.test is not None]
    if not tests:
        return [early]
    found = [early, cost_figure(f"late ticks, {kind}", "%", [test.late for test in tests])]
    if kind == WITHOUT:
        return found
    shares = [test.share for test in tests if math.isfinite(test.share)]
    return [
        *found,
        *beyond(kind, turns, without),
        *([cost_figure(f"processor of the view, {kind}", "% of one", shares)] if shares else []),
    ]


def beyond(kind: str, turns: list[Turn], without: list[Turn]) -> list[BenchmarkFigure]:
    """Late ticks minus those of the test without a view in the same turn; empty if no turn has both tests."""
    pairs = [(one.test, other.test) for one, other in zip(turns, without, strict=True)]
    both = [(one, other) for one, other in pairs if one is not None and other is not None]
    if not both:
        return []
    more = [(one.late - one.beside) - (other.late - other.beside) for one, other in both]
    figure = cost_figure(f"late ticks, {kind}, beyond without", "points", more, most=MOST)
    judged = all(one.priority and other.priority for one, other in both)
    return [figure if judged else figure._replace(met=None)]
