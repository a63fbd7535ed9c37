"""Sweeps over a Dask cluster: two machines as network namespaces, without a common file system; one is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

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


def wait_for(command: subprocess.Popen[bytes], user: Path, table: str, least: int) -> None:
    until = time.monotonic() + HANG_S
    while parts(user, table) < least:
        late = time.monotonic() > until or command.poll() is not None
        assert not late, (user / f"{table}.log").read_text()
        time.sleep(0.02)


@pytest.mark.timeout(600)
def test_a_killed_worker_and_a_killed_command_lose_no_row_and_repeat_none(
    machines: tuple[str, str], user: Path, tmp_path: Path
) -> None:
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
        ended(alone := sweep(first, user, "alone.parquet"), user / "alone.parquet.log")
        running.append(alone)

        command = sweep(first, user, "spread.parquet", "--dask", SCHEDULER)
        running.append(command)
        wait_for(command, user, "spread.parquet", 3)
        kill(running[2])
        wait_for(command, user, "spread.parquet", 6)
        kill(command)
        there = parts(user, "spread.parquet")
        assert 6 <= there < ROWS // 64

        running.append(worker(second, user, tmp_path / "again"))
        again = sweep(first, user, "spread.parquet", "--dask", SCHEDULER, "--json")
        running.append(again)
        ended(again, user / "spread.parquet.log")
        assert (user / "spread.parquet").read_bytes() == (user / "alone.parquet").read_bytes()
        assert not (user / "spread.parquet.parts").exists()
    finally:
        for process in running:
            process.kill()
            process.wait()


def kill(process: subprocess.Popen[bytes]) -> None:
    os.kill(process.pid, signal.SIGKILL)
    process.wait(10)
