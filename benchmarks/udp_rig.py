"""Round trip to a rig in another process, compared with that of a bare UDP socket to an echo."""

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
START_S = 0.3  # Python takes about 50 ms to start; a packet sent earlier would be lost
# rounds of each peer, in turns, and exchanges of a round: 2000 give 20 values above the 99th percentile
ROUNDS, EXCHANGES = 7, 2000
INTERVAL, WAIT = 0.002, 0.5  # s; the wait is long, so that a late answer is measured and not lost
ECHO = """
import socket, sys
place = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
place.bind(("127.0.0.1", int(sys.argv[1])))
while True:
    place.sendto(*place.recvfrom(200))
"""


def free() -> int:
    """A free port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as place:
        place.bind(("127.0.0.1", 0))
        return int(place.getsockname()[1])


@contextlib.contextmanager
def started(words: list[str]) -> Iterator[None]:
    """Run another process until the end of the block."""
    process = subprocess.Popen(words)
    time.sleep(START_S)
    try:
        yield
    finally:
        process.kill()
        process.wait()


def compiled(folder: str) -> str:
    """The path of the compiled example in C, empty without a compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return ""
    program = f"{folder}/udp_rig"
    subprocess.run([compiler, "-O2", "-o", program, EXAMPLES / "udp_rig.c", "-lm"], check=True)
    return program


def bare(place: socket.socket, port: int) -> Callable[[], None]:
    """A function that does one exchange with the echo at a port."""
    place.connect(("127.0.0.1", port))
    packet = bytes(SIZE)

    def exchange() -> None:
        place.send(packet)
        place.recv(200)

    return exchange


def ours(port: int) -> Callable[[], None]:
    """A function that sends one command to a rig and receives and checks its answer."""
    rig = UdpRig(COLUMN_CHANNELS, Terms(f"udp/{port}", "[rig]", INTERVAL, 1, WAIT, 5.0, 60.0, 5, paced=True))
    rig.arm()

    def exchange() -> None:
        rig.write((1e-3,))
        rig.read()

    return exchange


def trips(exchange: Callable[[], None], count: int) -> list[float]:
    """`count` round trips in µs, sorted."""
    found = []
    for _ in range(count):
        begun = time.perf_counter_ns()
        exchange()
        found.append((time.perf_counter_ns() - begun) * 1e-3)
    return sorted(found)


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """Measure the echo and the rigs in turns."""
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
        echo = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        ends = {
            name: bare(echo, port) if number == 0 else ours(port)
            for number, (name, port) in enumerate(zip(peers, ports, strict=False))
        }
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
    """A percentile of the round trip (`part` in 0 to 1): best and median of all rounds."""
    values = [quantile(one, part) for one in found]
    median = statistics.median(values)
    ratio = median / beside if beside else None
    peer = "bare UDP" if beside else ""
    return BenchmarkFigure(f"{name}, p{part * 100:g}", "µs", min(values), median, peer=peer, ratio=ratio)
