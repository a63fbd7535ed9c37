"""How soon `rths serve` brings a rig towards rest after a client fails: measured at the rig, on the wall clock."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

from benchmarks.opensees.urgent import allowed, said
from benchmarks.result import BenchmarkFigure, cost_figure
from common.recording.reader import read

HERE = Path(__file__).parent
HOW = ("killed", "stalled", "malformed", "diverged")  # of benchmarks/opensees/failing.py
SECOND = "second"  # of the same file: a client that comes second
STEPS = 200
MOST_MS = 10.0  # five intervals of 2 ms: `ramp_after` beside a rig
RIG = '''
import json
import time


class Rig:
    """A stiff specimen that follows at once, and the time (Unix, ns) of each command."""

    def __init__(self, interval, seed, log):
        self._log, self._place, self._rows = log, 0.0, []

    def arm(self):
        pass

    def read(self):
        return self._place, 6.25e6 * self._place

    def write(self, command):
        self._place = command.actuator_command
        self._rows.append((time.time_ns(), self._place))

    def disarm(self):
        with open(self._log, "w") as file:
            json.dump(self._rows, file)
'''


def run(
    folder: Path, serve: Callable[[str], AbstractContextManager[int]], repeats: int
) -> Iterator[BenchmarkFigure]:
    """A figure for each way to fail; `serve` serves at a port, given tables that are added to the plan."""
    (folder / "timed.py").write_text(RIG)
    log = folder / "commands.json"
    rig = f'[master.rig]\nclass = "timed.py:Rig"\noptions = {{ log = {json.dumps(str(log))} }}\n'
    priority = allowed()
    for how in HOW:
        found: list[float] = []
        for _ in range(repeats):
            log.unlink(missing_ok=True)
            with serve(rig) as port:
                line = said(command(port, how), priority)
            if line:  # otherwise the machine was so slow that the test ended before
                ramp = read(folder / "served.mcap").ramps["master"]["seq"].size
                found.append(
                    first_of_the_ramp(json.loads(log.read_text()), ramp, int(json.loads(line)["last_ns"]))
                )
        yield figure(f"rths serve, a client that is {how}, to the first command of the ramp to rest", found)
    closed: list[float] = []
    for _ in range(repeats):
        with serve(rig) as port:
            line = said(command(port, SECOND), priority)
        first = read(folder / "served.mcap").columns["master"]["client_step"]
        if line and first.max() >= 2 * STEPS:  # the first client had all its displacements
            closed.append(float(json.loads(line)["closed_ms"]))
    yield figure("rths serve, a second client beside one that goes on, to its refusal", closed)


def figure(title: str, found: list[float]) -> BenchmarkFigure:
    """The figure of some times (ms), where there are any."""
    if found:
        return cost_figure(title, "ms", found, most=MOST_MS)
    return BenchmarkFigure(f"{title}: all tests ended before", "ms", None, None)


def command(port: int, how: str) -> list[str]:
    """The command line of a client that fails."""
    return [sys.executable, str(HERE / "failing.py"), str(port), str(STEPS), how]


def first_of_the_ramp(rows: list[tuple[int, float]], ramp: int, last_ns: int) -> float:
    """The time (ms) from `last_ns` to the first of the last `ramp` commands, which are those of the ramp."""
    return 1e-6 * (rows[-ramp][0] - last_ns)
