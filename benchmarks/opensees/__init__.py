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
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.opensees import safe
from benchmarks.opensees.urgent import HANG_S, allowed, said
from benchmarks.result import BenchmarkFigure, cost_figure, rate_figure
from benchmarks.whole_test import ROOT
from common.opensees.process import INTERPRETER
from common.plan.read import parse
from common.recording.reader import read
from common.recording.run import MACHINES, Run

HERE = Path(__file__).parent
LEAST = 3000.0  # steps/s
MOST_RATIO = 1.5  # p50 of the client's answer over that of bare TCP
MOST_LATE = 0.05  # percentage points beyond the bare timing loop, or bare TCP
STEPS, PACED, REPEATS = 5000, 3000, 3
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
        found = [*fastest(place, steps, repeats), *in_real_time(place, paced, repeats)]
        if quick:
            return found
        ordinary = with_an_ordinary_client(place, paced, repeats)
        return [*found, *ordinary, *safe.run(place, partial(with_tables, place), repeats)]


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


def rate(words: Sequence[str], priority: int = 0) -> list[float]:
    """Steps per second that a client says, none where it says nothing; `priority` is its real-time one, if any."""
    line = said(words, priority)
    return [float(json.loads(line)["rate"])] if line else []


class Paced(NamedTuple):
    """What one test in real time shows, of `rths serve` or of bare TCP."""

    p50: float  # µs, from the force handed over to the client's next displacement
    client_late: float  # %, ticks whose displacement the client had not sent in time though it had time
    woke_late: float = (
        0.0  # percentage points, ticks that began an interval late, beyond those of a bare timing loop
    )
    real_time: bool = True  # whether the server had real-time priority


def in_real_time(folder: Path, steps: int, repeats: int) -> Iterator[BenchmarkFigure]:
    """A displacement every 2 ms, beside bare TCP in turn, under a client of real-time priority where it may have it.

    Otherwise other processes of the machine, which keep an ordinary client from its processor, would decide.
    """
    priority = allowed()
    yield from judged(*in_turn(folder, steps, repeats, priority), granted=bool(priority))


def with_an_ordinary_client(folder: Path, steps: int, repeats: int) -> Iterator[BenchmarkFigure]:
    """The late displacements of a client without real-time priority, which are those of the machine."""
    ours, bare = in_turn(folder, steps, repeats, 0)
    for name, found in (("rths serve", ours), ("bare TCP", bare)):
        title = f"{name} every 2 ms, late displacements of an ordinary client"
        yield cost_figure(title, "%", [one.client_late for one in found])


def in_turn(folder: Path, steps: int, repeats: int, priority: int) -> tuple[list[Paced], list[Paced]]:
    """`rths serve` and bare TCP under the same client of a real-time `priority`, 0 for none, one after the other."""
    ours: list[Paced] = []
    bare: list[Paced] = []
    for _ in range(repeats):
        bare.append(alone(steps, priority))
        with served(folder, "--beside") as port:
            rate([sys.executable, str(HERE / "client.py"), str(port), str(steps)], priority)
        ours.append(found_in(read(folder / "served.mcap")))
    return ours, bare


def judged(ours: list[Paced], bare: list[Paced], *, granted: bool) -> Iterator[BenchmarkFigure]:
    """The figures that have targets; they are judged where the server and the client had real-time priority."""
    pairs = list(zip(ours, bare, strict=True))
    ratio = statistics.median(one.p50 / other.p50 for one, other in pairs)
    title = "rths serve every 2 ms, force handed over to next displacement, p50"
    waits = [one.p50 for one in ours]
    figures = [
        BenchmarkFigure(
            title,
            "µs",
            min(waits),
            statistics.median(waits),
            f"≤ {MOST_RATIO} × bare TCP",
            ratio <= MOST_RATIO,
        )._replace(peer="bare TCP", ratio=ratio),
        cost_figure(
            "rths serve every 2 ms, ticks that begin late, beyond a bare timing loop's",
            "points",
            [one.woke_late for one in ours],
            most=MOST_LATE,
        ),
        cost_figure(
            "rths serve every 2 ms, late displacements of its client, beyond those under bare TCP",
            "points",
            [one.client_late - other.client_late for one, other in pairs],
            most=MOST_LATE,
        ),
    ]
    fair = granted and all(one.real_time for one in ours)
    yield from (figure if fair else figure._replace(met=None) for figure in figures)
    yield cost_figure("bare TCP every 2 ms, the same messages, p50", "µs", [one.p50 for one in bare])


def found_in(recorded: Run) -> Paced:
    """What a recording of `rths serve` shows."""
    of, machines = recorded.columns["master"], recorded.metadata[MACHINES]
    waits = of["client_wait"][np.isfinite(of["client_wait"])]
    loop = {name: float(machines[f"bare_loop.{name}"]) for name in ("ticks", "late")}
    beside = loop["late"] / max(loop["ticks"] + loop["late"], 1.0)
    return Paced(
        float(np.median(waits)) * 1e6,
        100.0 * float(np.mean(of["client_late"])),
        100.0 * (float(np.mean(of["wake_lateness"] > INTERVAL)) - beside),
        float(machines["master.priority"]) > 0,
    )


def alone(steps: int, priority: int) -> Paced:
    """The same of bare TCP."""
    port, share = free_port(), parse(PLAN, Path()).link.wait_share
    words = [sys.executable, "-m", "benchmarks.opensees.bare", *map(str, (port, steps, INTERVAL, share))]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        rate([sys.executable, str(HERE / "client.py"), str(port), str(steps)], priority)
        said, _ = process.communicate(timeout=HANG_S)
    found = json.loads(said)
    ticks = len(found["waits"]) + found["late"]
    return Paced(float(np.median(found["waits"])) * 1e6, 100.0 * found["late"] / ticks)


@contextlib.contextmanager
def with_tables(folder: Path, tables: str) -> Iterator[int]:
    """`rths serve` in real time of the plan with further tables."""
    (folder / "served.toml").write_text(PLAN + tables)
    with served(folder, "--beside") as port:
        yield port


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
                process.wait(HANG_S)
        finally:
            process.terminate()


def free_port() -> int:
    """A port that nobody uses."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])
