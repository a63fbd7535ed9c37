"""A rig in another process: its round trip beside that of a bare UDP socket whose other end sends back what it gets."""

from __future__ import annotations

import contextlib
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.result import BenchmarkFigure
from common.signals import COLUMN_CHANNELS
from common.udp.account import quantile
from common.udp.packets import SIZE
from common.udp.rig import Terms, UdpRig

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
ROUNDS, EXCHANGES = 7, 2000  # of each figure, in turns
INTERVAL, WAIT = 0.002, 0.5  # s; every answer is waited for, so that a held-up one counts
ECHO = """
import socket, sys
place = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
place.bind(("127.0.0.1", int(sys.argv[1])))
while True:
    place.sendto(*place.recvfrom(200))
"""


def free() -> int:
    """A port that nobody uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as place:
        place.bind(("127.0.0.1", 0))
        return int(place.getsockname()[1])


@contextlib.contextmanager
def started(words: list[str]) -> Iterator[None]:
    """Another process, for as long as it is needed."""
    process = subprocess.Popen(words)
    time.sleep(0.3)
    try:
        yield
    finally:
        process.kill()
        process.wait()


def compiled(folder: str) -> str:
    """The example in C, empty where there is no compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return ""
    program = f"{folder}/udp_rig"
    subprocess.run([compiler, "-O2", "-o", program, EXAMPLES / "udp_rig.c", "-lm"], check=True)
    return program


def bare(port: int) -> Callable[[], None]:
    """One exchange with the echo."""
    place = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    place.connect(("127.0.0.1", port))
    packet = bytes(SIZE)

    def exchange() -> None:
        place.send(packet)
        place.recv(200)

    return exchange


def ours(port: int) -> Callable[[], None]:
    """One command to a rig and its answer, checked."""
    rig = UdpRig(COLUMN_CHANNELS, Terms(f"udp/{port}", "[rig]", INTERVAL, 1, WAIT, 5.0, 60.0, 5, paced=True))
    rig.arm()

    def exchange() -> None:
        rig.write((1e-3,))
        rig.read()

    return exchange


def trips(exchange: Callable[[], None], count: int) -> list[float]:
    """Round trips in µs, sorted."""
    found = []
    for _ in range(count):
        begun = time.perf_counter_ns()
        exchange()
        found.append((time.perf_counter_ns() - begun) * 1e-3)
    return sorted(found)


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """Figures of each other end, in turns."""
    rounds, count = (1, 50) if quick else (ROUNDS, EXCHANGES)
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        program, ports = compiled(folder), [free() for _ in range(3)]
        peers = {
            "bare UDP, echo in Python": [sys.executable, "-c", ECHO, str(ports[0])],
            "rig in Python": [
                sys.executable,
                str(EXAMPLES / "udp_rig.py"),
                "--listen",
                f"127.0.0.1:{ports[1]}",
            ],
        }
        if program:
            peers["rig in C"] = [program, "127.0.0.1", str(ports[2])]
        for words in peers.values():
            stack.enter_context(started(words))
        ends = {name: (bare if place == 0 else ours)(ports[place]) for place, name in enumerate(peers)}
        found: dict[str, list[list[float]]] = {name: [] for name in ends}
        for _ in range(rounds):
            for name, exchange in ends.items():
                found[name].append(trips(exchange, count))
    beside = statistics.median(quantile(one, 0.5) for one in found["bare UDP, echo in Python"])
    return [
        figure(name, part, values, beside if place and part == 0.5 else 0.0)
        for place, (name, values) in enumerate(found.items())
        for part in (0.5, 0.99)
    ]


def figure(name: str, part: float, found: list[list[float]], beside: float) -> BenchmarkFigure:
    """A percentile of the round trip, best and median of all rounds."""
    values = [quantile(one, part) for one in found]
    median = statistics.median(values)
    ratio = median / beside if beside else None
    peer = "bare UDP" if beside else ""
    return BenchmarkFigure(f"{name}, p{part * 100:g}", "µs", min(values), median, peer=peer, ratio=ratio)
