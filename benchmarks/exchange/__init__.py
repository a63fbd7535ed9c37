"""The exchange of a tick, compared with bare zenoh, bare sockets and TLS: free-running, paced, loaded, over a cable."""

from __future__ import annotations

import contextlib
import json
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.cable import ADDRESSES, NoCableError, cable
from benchmarks.exchange.transports import NAMES
from benchmarks.load import BUSY, busy
from benchmarks.result import BenchmarkFigure
from common.host.realtime import assign
from common.link.zenoh_link import listenable
from rths.prepare import keys

ROOT = Path(__file__).resolve().parents[2]
REPEATS = 3  # odd, so that the median is a measured value; the whole takes a few minutes
INTERVAL = 0.002  # s, of the default test
LOCAL = ("127.0.0.1", "127.0.0.1")
PEERS = {"zenoh": "bare zenoh", "tcp": "bare TCP", "udp": "bare UDP"}
OURS = {"rths": "exchange", "rths_lab": "exchange with the emulated laboratory"}
DAY = timedelta(days=1)


class Scenario(NamedTuple):
    """One way to run the exchange; `most` holds the largest ratio to bare zenoh that is the target, by percentile."""

    name: str
    interval: float
    rounds: int
    most: dict[int, float]
    loaded: bool = False
    wired: bool = False


# Targets: codec, check, limits and the slave's step may add a quarter to the median of bare zenoh, half to its tail.
SCENARIOS = (
    Scenario("free-running", 0.0, 60, {50: 1.25}),
    Scenario("every 2 ms", INTERVAL, 30, {50: 1.25, 99: 1.5}),
    Scenario(f"every 2 ms beside {BUSY} busy processes", INTERVAL, 30, {}, loaded=True),
    Scenario("free-running over a cable", 0.0, 60, {}, wired=True),
    Scenario("every 2 ms over a cable", INTERVAL, 30, {}, wired=True),
)
QUICK = (Scenario("free-running", 0.0, 1, {}), Scenario("free-running over a cable", 0.0, 1, {}, wired=True))


class ExchangeError(Exception):
    """A run without a result; the text says why."""


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """Run all scenarios, each several times."""
    scenarios, repeats = (QUICK, 1) if quick else (SCENARIOS, REPEATS)
    figures = []
    for scenario in scenarios:
        try:
            runs = [once(scenario) for _ in range(repeats)]
        except (NoCableError, ExchangeError) as reason:
            figures.append(BenchmarkFigure(f"{scenario.name}: {reason}", "µs", None, None))
            continue
        figures += [figure for name, words in OURS.items() for figure in ours(scenario, name, words, runs)]
        figures += secured(scenario, runs)
        figures += [peer(scenario, name, words, runs) for name, words in PEERS.items()]
    return figures


def percentile(found: dict[str, Any], name: str, share: int) -> float:
    """A percentile (`share` in %) of a transport's round trips in one run, µs."""
    return float(np.percentile(found["trips"][name], share)) * 1e-3


def ours(scenario: Scenario, name: str, words: str, runs: list[dict[str, Any]]) -> Iterator[BenchmarkFigure]:
    """Median and 99th percentile of the exchange, compared with bare zenoh in the same run."""
    for share in (50, 99):
        values = [percentile(found, name, share) for found in runs]
        ratios = [percentile(found, name, share) / percentile(found, "zenoh", share) for found in runs]
        ratio, most = statistics.median(ratios), scenario.most.get(share)
        judged = most is not None and (not scenario.interval or runs[0]["granted"]["priority"] > 0)
        yield BenchmarkFigure(
            f"{words}, {scenario.name}, p{share}",
            "µs",
            min(values),
            statistics.median(values),
            f"≤ {most} × zenoh" if most else "",
            ratio <= most if judged and most else None,
            "bare zenoh",
            ratio,
        )


def secured(scenario: Scenario, runs: list[dict[str, Any]]) -> Iterator[BenchmarkFigure]:
    """Median and 99th percentile of the exchange over TLS, compared with that over TCP in the same run."""
    for share in (50, 99):
        values = [percentile(found, "rths_tls", share) for found in runs]
        ratios = [percentile(found, "rths_tls", share) / percentile(found, "rths", share) for found in runs]
        yield BenchmarkFigure(
            f"exchange over TLS, {scenario.name}, p{share}",
            "µs",
            min(values),
            statistics.median(values),
            peer="exchange",
            ratio=statistics.median(ratios),
        )


def peer(scenario: Scenario, name: str, words: str, runs: list[dict[str, Any]]) -> BenchmarkFigure:
    """Median of a bare transport."""
    values = [percentile(found, name, 50) for found in runs]
    return BenchmarkFigure(f"{words}, {scenario.name}, p50", "µs", min(values), statistics.median(values))


def once(scenario: Scenario) -> dict[str, Any]:
    """The result of one run of benchmarks/exchange/ask.py: the key `trips` holds the round trips by transport, ns."""
    with contextlib.ExitStack() as stack:
        if scenario.loaded:
            stack.enter_context(busy())
        places: list[list[str]] = [[], []]
        here, there = LOCAL
        if scenario.wired:
            names = stack.enter_context(cable())
            places = [["ip", "netns", "exec", name] for name in names]
            here, there = ADDRESSES
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        now = datetime.now(UTC)
        keys.write(folder, keys.certificates(("master", "slave"), (here,), now - DAY, now + DAY))
        ports = [listenable().rpartition(":")[2] for _ in NAMES]
        processors = [[] if place is None else ["--processor", str(place)] for place in assign(2)]
        answering = ["answer", "--asking", here, "--here", there, "--ports", *ports, *processors[1]]
        answering += ["--keys", str(folder)]
        stack.enter_context(answerer([*places[1], *module(answering)]))
        asking = ["ask", "--here", here, "--answering", there, "--ports", *ports, *processors[0]]
        asking += [
            "--keys",
            str(folder),
            "--rounds",
            str(scenario.rounds),
            "--interval",
            str(scenario.interval),
        ]
        words = [*places[0], *module(asking)]
        found = subprocess.run(words, cwd=ROOT, check=False, capture_output=True, text=True, timeout=300)
    if found.returncode:
        lines = found.stderr.splitlines()
        raise ExchangeError(f"no round trips: {lines[-1] if lines else f'exit code {found.returncode}'}")
    result: dict[str, Any] = json.loads(found.stdout)
    return result


def module(words: list[str]) -> list[str]:
    """Command line of one of the two processes."""
    return [sys.executable, "-m", f"benchmarks.exchange.{words[0]}", *words[1:]]


@contextlib.contextmanager
def answerer(words: list[str]) -> Iterator[None]:
    """Run the answering process until the end of the block."""
    process = subprocess.Popen(words, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None  # noqa: S101 - it is a pipe
    process.stdout.readline()
    try:
        yield
    finally:
        try:
            process.communicate(timeout=30)
        except subprocess.TimeoutExpired:  # it waits for an asking process that failed to start
            process.kill()
            process.wait()
