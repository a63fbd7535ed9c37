"""The time of `rths catalog` over many recordings, and of a question to the catalogue, as whole commands."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.result import BenchmarkFigure, cost_figure
from benchmarks.whole_test import ROOT
from report.catalogue import store

RECORDINGS, QUICK_RECORDINGS = 1000, 8
# Different tests among them. The others are further names of the same files, so that only these take space: a catalogue
# reads and checks every file under each of its names, but from memory after the first time.
DIFFERENT, QUICK_DIFFERENT = 10, 2
DURATION, QUICK_DURATION = 40.0, 0.5  # s of a test
MOST = 20.0  # s to catalogue them
MOST_QUERY = 0.2  # s of a question: below that a command is felt to answer at once
REPEATS, QUESTIONS = 3, 9  # odd, so that the median is a measured value
BARE = "import sqlite3, sys; sqlite3.connect(sys.argv[1]).execute('SELECT * FROM recordings').fetchall()"
QUESTION = "peak drift > 5 mm and outcome = completed"


def record(folder: Path, different: int, recordings: int, duration: float) -> None:
    """Play different tests in virtual time, and give their recordings further names."""
    for seed in range(different):
        command(
            "run",
            "--virtual",
            "--duration",
            str(duration),
            "--seed",
            str(seed),
            "-o",
            folder / f"{seed:04d}.mcap",
        )
    for number in range(different, recordings):
        os.link(folder / f"{number % different:04d}.mcap", folder / f"{number:04d}.mcap")


def command(*words: str | Path) -> float:
    """Wall time of a command of rths, s."""
    return timed("-m", "rths", *words)


def timed(*words: str | Path) -> float:
    """Wall time of a program of the interpreter, s."""
    began = time.perf_counter()
    subprocess.run([sys.executable, *map(str, words)], cwd=ROOT, capture_output=True, check=True)
    return time.perf_counter() - began


def catalogued(folder: Path) -> float:
    """Seconds in which the catalogue of a folder is made from nothing."""
    (folder / store.NAME).unlink(missing_ok=True)
    return command("catalog", folder)


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """The time to make a catalogue, and of a question to it beside the same of bare SQLite."""
    recordings = QUICK_RECORDINGS if quick else RECORDINGS
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        record(
            folder,
            QUICK_DIFFERENT if quick else DIFFERENT,
            recordings,
            QUICK_DURATION if quick else DURATION,
        )
        made = [catalogued(folder) for _ in range(1 if quick else REPEATS)]
        asked, peer = [], []
        for _ in range(1 if quick else QUESTIONS):
            asked.append(command("catalog", "--in", folder, "find", QUESTION))
            peer.append(timed("-c", BARE, folder / store.NAME))
        with store.opened(folder / store.NAME) as base:
            (count,) = base.execute("SELECT count(*) FROM recordings WHERE state = 'whole'").fetchone()
        if count != recordings:
            raise RuntimeError(f"The catalogue has {count} of {recordings} recordings.")
    question = cost_figure("a question to that catalogue", "s", asked, most=MOST_QUERY)
    beside = cost_figure("all of it read by a bare interpreter with SQLite", "s", peer)
    if question.median is None or beside.median is None:
        raise RuntimeError("nothing was measured")
    return [
        cost_figure(f"`rths catalog`, {recordings:,} recordings from nothing", "s", made, most=MOST),
        question._replace(peer="a bare interpreter", ratio=question.median / beside.median),
        beside,
    ]
