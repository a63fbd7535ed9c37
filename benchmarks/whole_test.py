"""A whole test in processes of its own; the number of tests that end early is a figure as well."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks.result import BenchmarkFigure
from common.errors import RthsError
from common.recording.reader import read
from common.recording.run import Run

ROOT = Path(__file__).resolve().parent.parent


class Ending(NamedTuple):
    """How a test ended: its exit code, the last line of its standard error, and its recording or None."""

    code: int
    said: str
    run: Run | None

    @property
    def completed(self) -> bool:
        """Whether the test was completed and has a recording."""
        return self.code == 0 and self.run is not None


def command(path: Path, *words: str) -> list[str]:
    """The command line of a test that is recorded to `path`."""
    return [sys.executable, "-m", "rths", "run", *words, "-o", str(path)]


def played(path: Path, *words: str) -> Ending:
    """Run a test until it is completed or ends early."""
    done = subprocess.run(command(path, *words), cwd=ROOT, check=False, capture_output=True, text=True)
    return ending(done.returncode, done.stderr, path)


def ending(code: int, said: str, path: Path) -> Ending:
    """The ending of a test with this exit code and this text on its standard error."""
    lines = [line for line in said.splitlines() if line.strip()]
    try:
        run = read(path)
    except (RthsError, OSError):  # the test ended before its recording began
        run = None
    return Ending(code, lines[-1] if lines else "", run)


def ended_early(name: str, endings: Sequence[Ending]) -> BenchmarkFigure:
    """The number of tests that ended early, with the last line of each."""
    early = [one for one in endings if not one.completed]
    points = [{"exit code": one.code, "said": one.said} for one in early]
    count = float(len(early))
    return BenchmarkFigure(
        f"{name}, ended early", f"of {len(endings)} tests", count, count, "0", not early, points=points
    )
