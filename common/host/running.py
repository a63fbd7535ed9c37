"""Registers the tests that run on this machine in real time, one small file each, so that commands find them.

The files of a user lie in a folder of that user. Their names, which contain the test and the process, can be read by
everybody, because the tests of other users disturb a test as much as one's own. Only their owner can read the content.
"""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from common.errors import InputError
from common.host.machine import began
from common.plan.plan import Plan

FOLDER = (
    "RTHS_RUNNING"  # environment variable: another place for the folders, for tests side by side on purpose
)
RUN = "run"  # the role of one that is a whole test
# A process that started later than its file by more than this has reused the process number of the file's writer. The
# start time is known to about 1 s only (`btime` in /proc/stat is in whole seconds); 2 s are on the safe side.
STARTED_LATER_S = 2.0


class Running(NamedTuple):
    """A test that runs here: its name, where its master listens, and its plan as TOML."""

    test: str
    endpoint: str
    folder: str  # of the plan's relative paths
    plan: str
    role: str = RUN  # `run`, or that of a laboratory that was started by itself
    recording: str = ""  # its file, empty for a laboratory that was started by itself
    since: float = 0.0  # Unix time of its registration, s, which a reader takes from the file


class Neighbour(NamedTuple):
    """What every user may know of a test that runs here."""

    test: str
    process: int
    user: int
    since: float  # Unix time, s


def home() -> Path:
    """The folder that holds a folder for each user."""
    return Path(os.environ.get(FOLDER) or tempfile.gettempdir())


def place() -> Path:
    """The folder of this user's files."""
    return home() / f"rths-{os.getuid()}"


@contextlib.contextmanager
def announced(plan: Plan, endpoint: str, role: str = RUN, *, recording: Path | None = None) -> Iterator[None]:
    """Register the test while the context lasts; where the file cannot be written, the test runs without it."""
    folder = place()
    path = folder / f"{plan.test.name}-{os.getpid()}.json"
    there = str(recording.resolve()) if recording else ""
    entry = Running(plan.test.name, endpoint, str(plan.base.resolve()), plan.toml(), role, there)
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        folder.chmod(0o755)
        with os.fdopen(
            os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w", encoding="utf-8"
        ) as file:
            file.write(json.dumps(entry._asdict()))
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)


def found() -> list[Running]:
    """The whole tests of this user whose process is alive; the files of ended ones are removed."""
    return [*by_process().values()]


def by_process() -> dict[int, Running]:
    """The same by the number of their processes, the newest last."""
    entries: list[tuple[float, int, Running]] = []
    for path in sorted(place().glob("*-*.json")):
        try:
            one = neighbour(path)
            if one is None:
                path.unlink(missing_ok=True)
            if one is None or one.user != os.getuid():
                continue
            entry = Running(**json.loads(path.read_text(encoding="utf-8")))
            entries.append((one.since, one.process, entry._replace(since=one.since)))
        except (OSError, ValueError, TypeError):
            continue
    return {process: entry for _, process, entry in sorted(entries) if entry.role == RUN}


def neighbours() -> list[Neighbour]:
    """Tests of all users of this machine, oldest first, without those of this process and of its parent."""
    seen = (neighbour(path) for path in home().glob("rths-*/*-*.json"))
    family = (os.getpid(), os.getppid())
    return sorted((one for one in seen if one and one.process not in family), key=lambda one: one.since)


def neighbour(path: Path) -> Neighbour | None:
    """The test behind a file; None where its process has ended, or where the file was not written by rths."""
    test, _, number = path.stem.rpartition("-")
    try:
        facts, process = path.stat(), int(number)
        start = began(process)
    except (OSError, ValueError):
        return None
    if start is None or start > facts.st_mtime + STARTED_LATER_S:
        return None
    return Neighbour(test, process, facts.st_uid, facts.st_mtime)


def alone() -> None:
    """Raise InputError where a test runs on this machine that began before that of this process."""
    own = next(iter(place().glob(f"*-{os.getpid()}.json")), None)
    since = own.stat().st_mtime if own else time.time()
    earlier = [one for one in neighbours() if (one.since, one.process) < (since, os.getpid())]
    if not earlier:
        return
    first = earlier[0]
    whose = "" if first.user == os.getuid() else f" of another user (uid {first.user})"
    when = time.strftime("%H:%M:%S", time.localtime(first.since))
    raise InputError(
        f"The test '{first.test}'{whose} runs on this machine since {when} (process {first.process}), and two tests "
        "at once disturb each other: wait for its end or stop it (`rths stop`), or give --beside to run all the same."
    )


def announced_already() -> bool:
    """Whether the process that has started this one has announced the test."""
    return any(place().glob(f"*-{os.getppid()}.json"))


def only(name: str | None = None) -> Running:
    """The only test that runs here, or the one with the given name.

    Raises:
        InputError: there is none, or more than one.
    """
    entries = [entry for entry in found() if name in (None, entry.test)]
    if not entries:
        what = f"named '{name}' " if name else ""
        raise InputError(
            f"No test {what}runs on this machine: give the plan and where its master listens, with --connect."
        )
    if len(entries) > 1:
        names = ", ".join(sorted({entry.test for entry in entries}))
        raise InputError(
            f"{len(entries)} tests run on this machine ({names}): say which with PLAN --connect."
        )
    return entries[0]
