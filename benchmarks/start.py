"""How long a user waits, and how much memory the laboratories take."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.result import Figure, cost_figure
from common.recording.reader import read
from common.zenoh_link import listenable

ROOT = Path(__file__).resolve().parent.parent
REPEATS = 5


def timed(words: list[str]) -> float:
    """Wall time of a command, s."""
    began = time.perf_counter()
    subprocess.run([sys.executable, "-m", *words], cwd=ROOT, capture_output=True, check=True)
    return time.perf_counter() - began


def first_tick(folder: str) -> float:
    """From the start of `rths run` to the first tick, s, by the recording's own time stamps."""
    path = Path(folder) / "a.mcap"
    began = time.time()
    timed(["rths", "run", "--duration", "0.2", "-o", str(path)])
    return float(read(path).log_ns["master"][0] * 1e-9 - began)


def memory(folder: str) -> dict[str, float]:
    """Largest resident memory of each process in a test of five seconds, MB."""
    endpoint = listenable()
    words = {
        "slave": ["--connect", endpoint],
        "recorder": ["--connect", endpoint, "-o", f"{folder}/b.mcap"],
        "master": ["--listen", endpoint],
    }
    running = {
        name: subprocess.Popen(
            [sys.executable, "-m", name, "default", "--duration", "5", *options],
            cwd=ROOT,
            stderr=subprocess.DEVNULL,
        )
        for name, options in words.items()
    }
    found: dict[str, float] = {}
    while any(process.poll() is None for process in running.values()):
        found |= {name: high for name, process in running.items() if (high := high_water(process.pid))}
        time.sleep(0.1)
    return found


def high_water(pid: int) -> float:
    """Largest resident memory of a process so far, MB; 0 where it has ended."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return sum(float(line.split()[1]) / 1024.0 for line in lines if line.startswith("VmHWM"))


def run() -> list[Figure]:
    """Help, first tick and memory, caches warm."""
    with tempfile.TemporaryDirectory() as folder:
        first_tick(folder)
        helps = [timed(["rths", "--help"]) for _ in range(REPEATS)]
        ticks = [first_tick(folder) for _ in range(REPEATS)]
        sizes = memory(folder)
    figures = [
        cost_figure("rths --help", "s", helps, most=0.3),
        cost_figure("rths run to the first tick", "s", ticks, most=3.0),
    ]
    return figures + [
        cost_figure(f"memory of the {name}", "MB", [size], most=200.0 if name != "recorder" else None)
        for name, size in sizes.items()
    ]
