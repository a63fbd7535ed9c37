"""The time to the help text and to the first tick, and the memory of the processes of a test."""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.result import BenchmarkFigure, cost_figure
from benchmarks.whole_test import ROOT, Ending, ended_early, played
from common.link.zenoh_link import listenable

REPEATS = 5  # odd, so that the median is a measured value
MEMORY_S, QUICK_S = 5.0, 0.2  # duration of the test whose memory is measured
MOST_HELP = 0.3  # s: below that a command is felt to answer without a delay
MOST_FIRST = 3.0  # s: an operator waits for it before every test
MOST_MEMORY = 200.0  # MB of a laboratory: it fits five times into 1 GB, that of a small industrial computer
POLL_S = 0.1  # between two looks at the memory; the kernel keeps the peak, only the last look before the end counts


def timed(words: list[str]) -> float:
    """Wall time of a command, s."""
    began = time.perf_counter()
    subprocess.run([sys.executable, "-m", *words], cwd=ROOT, capture_output=True, check=True)
    return time.perf_counter() - began


def first_tick(folder: str) -> tuple[float, Ending]:
    """Time (s) from the start of `rths run` to the first tick, by the time stamps recorded; NaN without a tick."""
    path = Path(folder) / f"{time.monotonic_ns()}.mcap"  # a new name, because no recording is overwritten
    began = time.time()
    ending = played(path, "--duration", "0.2")
    ticks = ending.run.log_ns.get("master") if ending.run else None
    return float(ticks[0] * 1e-9 - began) if ticks is not None and ticks.size else math.nan, ending


def memory(folder: str, seconds: float) -> dict[str, float]:
    """Peak resident memory of each process of a test, MB."""
    endpoint = listenable()
    words = {
        "slave": ["--connect", endpoint],
        "recorder": ["--connect", endpoint, "-o", f"{folder}/b.mcap"],
        "master": ["--listen", endpoint],
    }
    running = {
        name: subprocess.Popen(
            [sys.executable, "-m", name, "default", "--duration", str(seconds), *options],
            cwd=ROOT,
            stderr=subprocess.DEVNULL,
        )
        for name, options in words.items()
    }
    found: dict[str, float] = {}
    while any(process.poll() is None for process in running.values()):
        found |= {name: high for name, process in running.items() if (high := high_water(process.pid))}
        time.sleep(POLL_S)
    return found


def high_water(pid: int) -> float:
    """Peak resident memory of a process so far, MB; 0 if it has ended."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return sum(float(line.split()[1]) / 1024.0 for line in lines if line.startswith("VmHWM"))


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """Measure help, first tick and memory with filled caches."""
    repeats = 1 if quick else REPEATS
    with tempfile.TemporaryDirectory() as folder:
        if not quick:
            first_tick(folder)
        helps = [timed(["rths", "--help"]) for _ in range(repeats)]
        tests = [first_tick(folder) for _ in range(repeats)]
        sizes = memory(folder, QUICK_S if quick else MEMORY_S)
    ticks = [seconds for seconds, _ in tests if math.isfinite(seconds)]
    return [
        cost_figure("rths --help", "s", helps, most=MOST_HELP),
        ended_early("rths run of 0.2 s", [ending for _, ending in tests]),
        *([cost_figure("rths run to the first tick", "s", ticks, most=MOST_FIRST)] if ticks else []),
        *memory_figures(sizes),
    ]


def memory_figures(sizes: dict[str, float]) -> list[BenchmarkFigure]:
    """The memory of each process; the recorder has no target."""
    return [
        cost_figure(f"memory of the {name}", "MB", [size], most=MOST_MEMORY if name != "recorder" else None)
        for name, size in sizes.items()
    ]
