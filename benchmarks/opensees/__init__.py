"""`rths serve` under OpenSees and under a client of plain Python: steps a second, and paced beside bare TCP."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks.result import BenchmarkFigure, cost_figure, rate_figure
from benchmarks.whole_test import ROOT
from common.opensees.process import INTERPRETER
from common.recording.reader import read
from common.recording.run import MACHINES

HERE = Path(__file__).parent
LEAST = 3000.0  # steps/s
MOST_RATIO = 1.5  # p50 of the client's answer over that of bare TCP
MOST_LATE = 0.05  # percentage points beyond the bare timing loop
STEPS, PACED, REPEATS = 5000, 5000, 3
QUICK_STEPS = 200
INTERVAL = 0.002
PORT = "PORT"  # stands for it in a command line
PLAN = """
[test]
name = "served"
[slave]
kind = "none"
[actuator]
delay = 0.0
time_constant = 0.0
[compensator]
kind = "none"
[sensors]
column_displacement = 0.0
column_force = 0.0
"""


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """As fast as it goes, then paced."""
    steps, paced, repeats = (QUICK_STEPS, QUICK_STEPS, 1) if quick else (STEPS, PACED, REPEATS)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "served.toml").write_text(PLAN)
        return [*fastest(place, steps, repeats), *in_real_time(place, paced, repeats)]


def fastest(folder: Path, steps: int, repeats: int) -> Iterator[BenchmarkFigure]:
    """Steps per second in virtual time, of OpenSees where it is installed and of the client."""
    model = [
        os.environ.get(INTERPRETER) or sys.executable,
        str(HERE / "model.py"),
        "NewmarkExplicit",
        "Linear",
    ]
    clients = {
        "OpenSees": [*model, str(steps), "0", "1", PORT],
        "a client of plain Python": [sys.executable, str(HERE / "client.py"), PORT, str(steps)],
    }
    for name, words in clients.items():
        found: list[float] = []
        for _ in range(repeats):
            with served(folder, "--virtual") as port:
                found += rate([str(port) if word == PORT else word for word in words])
        title = f"rths serve --virtual under {name}"
        if found:
            yield rate_figure(title, "steps/s", found, least=LEAST)
        else:
            yield BenchmarkFigure(f"{title}: not installed", "steps/s", None, None)


def rate(words: Sequence[str]) -> list[float]:
    """Steps per second that a client says, none where it says nothing."""
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=120.0)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    return [float(json.loads(lines[-1])["rate"])] if lines else []


def in_real_time(folder: Path, steps: int, repeats: int) -> list[BenchmarkFigure]:
    """The client's next displacement after a force, every 2 ms, beside bare TCP; late ticks beside a bare loop's."""
    ours: list[float] = []
    bare: list[float] = []
    beyond: list[float] = []
    fifo = True
    for _ in range(repeats):
        bare.append(alone(steps))
        with served(folder, "--beside") as port:
            rate([sys.executable, str(HERE / "client.py"), str(port), str(steps)])
        recorded = read(folder / "served.mcap")
        of, machines = recorded.columns["master"], recorded.metadata[MACHINES]
        waits = of["client_wait"][np.isfinite(of["client_wait"])]
        ours.append(float(np.median(waits)) * 1e6)
        late = 100.0 * float(np.mean(of["client_late"] | (of["wake_lateness"] > INTERVAL)))
        loop = {name: float(machines[f"bare_loop.{name}"]) for name in ("ticks", "late")}
        beyond.append(late - 100.0 * loop["late"] / max(loop["ticks"] + loop["late"], 1.0))
        fifo = fifo and float(machines["master.priority"]) > 0
    ratio = statistics.median(a / b for a, b in zip(ours, bare, strict=True))
    title = "rths serve every 2 ms, force handed over to next displacement, p50"
    figure = BenchmarkFigure(title, "µs", min(ours), statistics.median(ours), f"≤ {MOST_RATIO} × bare TCP")
    late_figure = cost_figure(
        "rths serve, late ticks beyond a bare timing loop's", "points", beyond, most=MOST_LATE
    )
    return [
        figure._replace(met=ratio <= MOST_RATIO if fifo else None, peer="bare TCP", ratio=ratio),
        late_figure if fifo else late_figure._replace(met=None),
        BenchmarkFigure(
            "bare TCP every 2 ms, the same messages, p50", "µs", min(bare), statistics.median(bare)
        ),
    ]


def alone(steps: int) -> float:
    """Median of the same wait over bare TCP, µs."""
    port = free_port()
    words = [sys.executable, "-m", "benchmarks.opensees.bare", str(port), str(steps), str(INTERVAL)]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        rate([sys.executable, str(HERE / "client.py"), str(port), str(steps)])
        said, _ = process.communicate(timeout=60.0)
    return float(np.median(json.loads(said))) * 1e6


@contextlib.contextmanager
def served(folder: Path, *words: str) -> Iterator[int]:
    """`rths serve` of the plan, recorded to `served.mcap`; its port, at which it may be waited for."""
    port = free_port()
    command = [sys.executable, "-m", "rths", "serve", str(folder / "served.toml"), *words]
    command += ["--opensees", f"127.0.0.1:{port}", "-o", str(folder / "served.mcap"), "--force"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            yield port
            with contextlib.suppress(subprocess.TimeoutExpired):  # no client came
                process.wait(60.0)
        finally:
            process.terminate()


def free_port() -> int:
    """A port that nobody uses."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])
