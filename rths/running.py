"""Tests that run on this machine, so that `rths stop` and `rths reset` find them: a small file each."""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from common.errors import InputError
from common.plan import Plan


class Running(NamedTuple):
    """A test that runs here: its name, where its master listens, and its plan as TOML."""

    test: str
    endpoint: str
    folder: str  # of the plan's relative paths
    plan: str


def place() -> Path:
    """The folder of this user's files."""
    return Path(tempfile.gettempdir()) / f"rths-{os.getuid()}"


@contextlib.contextmanager
def announced(plan: Plan, endpoint: str) -> Iterator[None]:
    """While the context lasts, the test can be found; where nothing can be written it cannot, and runs all the same."""
    folder = place()
    path = folder / f"{plan.test.name}-{os.getpid()}.json"
    entry = Running(plan.test.name, endpoint, str(plan.base.resolve()), plan.toml())
    with contextlib.suppress(OSError):
        folder.mkdir(mode=0o700, exist_ok=True)
        path.write_text(json.dumps(entry._asdict()), encoding="utf-8")
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)


def found() -> list[Running]:
    """The tests of this user whose process is alive, files of dead ones cleared away."""
    entries = []
    for path in sorted(place().glob("*-*.json")):
        try:
            os.kill(int(path.stem.rpartition("-")[2]), 0)
            entries.append(Running(**json.loads(path.read_text(encoding="utf-8"))))
        except ProcessLookupError:
            path.unlink(missing_ok=True)
        except (OSError, ValueError, TypeError):
            continue
    return entries


def only(name: str | None = None) -> Running:
    """The one test that runs here, or the one of that name.

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
