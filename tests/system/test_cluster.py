"""Work over a Dask cluster: two machines as network namespaces, without a common file system; one is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import pytest

from benchmarks.cable import ADDRESSES, NoCableError, cable
from tests.processes import HANG_S, environment, tied

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed: make cluster"),
]

PORT = 8786
SCHEDULER = f"tcp://{ADDRESSES[0]}:{PORT}"
ROWS = 1280
SWEEP = f"""
plan = "plan/own.toml"
draws = {ROWS}
[[motion]]
record = "own.AT2"
scales = [0.2]
[drawn]
structure.damping = {{ dispersion = 0.3 }}
"""
PLAN = "[test]\nname = 'spread'\nduration = 20.0\n"


@pytest.fixture
def machines() -> Iterator[tuple[str, str]]:
    try:
        with cable() as names:
            yield names
    except NoCableError as reason:
        pytest.skip(str(reason))


@pytest.fixture
def user(tmp_path: Path) -> Path:
    """A user's folder, which the workers do not see."""
    folder = tmp_path / "user"
    (folder / "plan").mkdir(parents=True)
    (folder / "plan" / "own.toml").write_text(PLAN)
    (folder / "sweep.toml").write_text(SWEEP)
    record = next(Path("models/ground_motion/records").glob("RSN77*.AT2"))
    (folder / "own.AT2").write_bytes(record.read_bytes())
    return folder


def start(machine: str, *words: str | Path, hidden: Path | None = None, log: Path) -> subprocess.Popen[bytes]:
    """Start a program on a machine; on a `hidden` folder lies an empty one, as on a machine that does not have it."""
    inside = ["ip", "netns", "exec", machine]
    if hidden is not None:
        script = 'mount -t tmpfs none "$0" && exec "$@"'
        inside += ["unshare", "--mount", "--propagation", "private", "sh", "-c", script, str(hidden)]
    with log.open("wb") as stream:
        return subprocess.Popen(
            tied(*inside, *map(str, words)), stdout=stream, stderr=subprocess.STDOUT, env=environment()
        )


def worker(machine: str, user: Path, place: Path) -> subprocess.Popen[bytes]:
    """A worker with one thread and no nanny, so that nobody starts it again."""
    own = place / f"worker-{machine}"
    own.mkdir(parents=True)
    return start(
        machine,
        *(sys.executable, "-m", "distributed.cli.dask_worker", SCHEDULER, "--nthreads", "1", "--no-nanny"),
        *("--no-dashboard", "--local-directory", own),
        hidden=user,
        log=own / "log",
    )


def sweep(machine: str, user: Path, table: str, *words: str) -> subprocess.Popen[bytes]:
    command = ("-m", "rths", "sweep", user / "sweep.toml", "-o", user / table, *words)
    return start(machine, sys.executable, *map(str, command), log=user / f"{table}.log")


def ended(process: subprocess.Popen[bytes], log: Path, code: int = 0) -> None:
    assert process.wait(200) == code, log.read_text()


def parts(user: Path, table: str) -> int:
    return len(list((user / f"{table}.parts").glob("*.arrow")))


def wait_for(
    command: subprocess.Popen[bytes], user: Path, table: str, least: int, log: str = "spread.parquet"
) -> None:
    until = time.monotonic() + HANG_S
    while parts(user, table) < least:
        late = time.monotonic() > until or command.poll() is not None
        assert not late, (user / f"{log}.log").read_text()
        time.sleep(0.02)


@pytest.fixture
def cluster(machines: tuple[str, str], user: Path, tmp_path: Path) -> Iterator[Cluster]:
    """A scheduler on the first machine and a worker on each; all that a test starts is ended after it."""
    first, second = machines
    scheduler = start(
        first,
        *(sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", ADDRESSES[0]),
        *("--port", str(PORT), "--no-dashboard"),
        log=tmp_path / "scheduler",
    )
    running = [scheduler]
    try:
        running += [worker(first, user, tmp_path), worker(second, user, tmp_path)]
        yield Cluster(first, second, running)
    finally:
        for process in running:
            process.kill()
            process.wait()


class Cluster(NamedTuple):
    """Two machines, and what runs there: the scheduler, a worker on each, and what a test added."""

    first: str
    second: str
    running: list[subprocess.Popen[bytes]]

    def begun(self, process: subprocess.Popen[bytes]) -> subprocess.Popen[bytes]:
        """A process that is ended with the others."""
        self.running.append(process)
        return process


@pytest.mark.timeout(600)
def test_a_killed_worker_and_a_killed_command_lose_no_row_and_repeat_none(
    cluster: Cluster, user: Path, tmp_path: Path
) -> None:
    first, second, running = cluster
    ended(cluster.begun(sweep(first, user, "alone.parquet")), user / "alone.parquet.log")

    command = cluster.begun(sweep(first, user, "spread.parquet", "--dask", SCHEDULER))
    wait_for(command, user, "spread.parquet", 3)
    kill(running[2])
    wait_for(command, user, "spread.parquet", 6)
    kill(command)
    there = parts(user, "spread.parquet")
    assert 6 <= there < ROWS // 64

    cluster.begun(worker(second, user, tmp_path / "again"))
    again = cluster.begun(sweep(first, user, "spread.parquet", "--dask", SCHEDULER, "--json"))
    ended(again, user / "spread.parquet.log")
    assert (user / "spread.parquet").read_bytes() == (user / "alone.parquet").read_bytes()
    assert not (user / "spread.parquet.parts").exists()


PATIENCE = 400.0  # s, for a proof that hangs: alone on a slow machine it takes two minutes
GOAL = """
[[candidate]]
scales = [0.02, 0.1]
durations = 5.0
"""
PROOFS = {
    "blind": ("blind", "--cases", "5", "--set", "tune", "--duration", "6"),
    "benchmark2020": ("benchmark2020", "--plants", "1", "--only", "sample"),
    "campaign": ("campaign", "goal.toml", "--compare-random", "4", "--set", "tune"),
}


@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", PROOFS)
def test_a_proof_whose_worker_is_killed_gives_the_table_of_one_machine(
    cluster: Cluster, user: Path, name: str
) -> None:
    (user / "goal.toml").write_text(GOAL)
    words = [str(user / word) if word.endswith(".toml") else word for word in PROOFS[name]]

    def begun(folder: str, *more: str) -> subprocess.Popen[bytes]:
        command = (sys.executable, "-m", "rths", *words, "-o", user / folder, *more)
        return cluster.begun(start(cluster.first, *map(str, command), log=user / f"{folder}.log"))

    done = (0, 1)  # of a few cases some may miss a goal, of time as well
    assert begun("alone", "--jobs", "1").wait(PATIENCE) in done, (user / "alone.log").read_text()
    spread = begun("spread", "--dask", SCHEDULER)
    wait_for(spread, user, "spread/results.parquet", 1, "spread")
    kill(cluster.running[2])
    assert spread.wait(PATIENCE) in done, (user / "spread.log").read_text()
    tables = [(user / folder / "results.parquet").read_bytes() for folder in ("alone", "spread")]
    assert tables[0] == tables[1]
    assert not (user / "spread" / "results.parquet.parts").exists()


def kill(process: subprocess.Popen[bytes]) -> None:
    os.kill(process.pid, signal.SIGKILL)
    process.wait(10)
