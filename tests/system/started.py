"""Commands and processes of the whole system, as a user starts them."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from common.recording.reader import read
from tests.helpers import PATIENT
from tests.processes import HANG_S, environment, tied

STARTED: list[subprocess.Popen[str]] = []  # by the test that runs


def start(*words: str | Path, module: str = "rths", **options: Any) -> subprocess.Popen[str]:
    STARTED.append(
        subprocess.Popen(
            tied(sys.executable, "-m", module, *words),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment(),
            **options,
        )
    )
    return STARTED[-1]


def end_started() -> list[str]:
    """End what `start` has started and close its pipes; the command lines of what still ran.

    A pipe that stays open would fail another test, in which it is collected.
    """
    left = [str(process.args) for process in STARTED if process.poll() is None]
    for process in STARTED:
        process.kill()
        with process:  # which closes the pipes
            pass
    STARTED.clear()
    return left


def finish(process: subprocess.Popen[str], seconds: float = HANG_S) -> tuple[int, str, str]:
    out, err = process.communicate(timeout=seconds)
    return process.returncode, out, err


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def plan_file(folder: Path, **link: float) -> Path:
    path = folder / "plan.toml"
    keys = "\n".join(f"{name} = {value}" for name, value in link.items())
    path.write_text(
        f"[test]\nname = 'trial'\nduration = 4.0\n[recording]\npatience = 1.0\n{PATIENT}[link]\n{keys}\n"
    )
    return path


def crew(process: subprocess.Popen[str]) -> dict[str, int]:
    """Process numbers of master, slave and recorder of a run, as soon as all are there."""
    deadline = time.monotonic() + HANG_S
    found: dict[str, int] = {}
    while set(found) != {"master", "slave", "recorder"}:
        assert time.monotonic() < deadline, found
        time.sleep(0.02)
        found = {}
        for children in Path(f"/proc/{process.pid}/task").glob("*/children"):
            with contextlib.suppress(OSError):  # a thread that has ended meanwhile
                found |= {module(child): int(child) for child in children.read_text().split()}
    return found


def module(number: str) -> str:
    """What a process runs with `python -m`."""
    words = Path(f"/proc/{number}/cmdline").read_text().split("\0")
    return words[words.index("-m") + 1] if "-m" in words else ""


def gone(number: int) -> bool:
    """Whether a process has ended."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def wait_for_ticks(path: Path, ticks: int = 200, seconds: float = HANG_S) -> None:
    """Until a recording that is being written holds some ticks."""
    deadline = time.monotonic() + seconds
    seen = "no file"
    while time.monotonic() < deadline:
        if path.exists() and path.stat().st_size > 10_000:
            try:
                found = read(path).ticks("master")
                seen = f"{found} ticks in {path.stat().st_size} bytes"
            except Exception as error:  # a chunk that is being written
                found, seen = 0, repr(error)
            if found >= ticks:
                return
        time.sleep(0.1)
    others = [path.name for path in path.parent.iterdir()]
    raise AssertionError(f"no {ticks} ticks in {path} after {seconds} s: {seen}; in its folder {others}")
