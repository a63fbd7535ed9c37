"""Runs tests that failed once more, alone: `python -m tests.again CACHE PYTEST-ARGUMENTS …` (docs/decisions/0027).

CACHE is the folder in which the first run kept what had failed. Only where fewer than ten did: more are no accident of
this machine. The exit code is that of the second run, 1 without one; a line names each test that needed it.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

FEW = 10
LIMIT_S = 1500.0  # a limit of last resort: every test has its own


def failed(cache: Path) -> set[str]:
    """The tests that failed in the last run; none where there was no such run."""
    path = cache / "v" / "cache" / "lastfailed"
    return set(json.loads(path.read_text(encoding="utf-8"))) if path.is_file() else set()


def again(cache: Path, words: list[str]) -> int:
    """Run what failed; the exit code."""
    first = failed(cache)
    if not first or len(first) >= FEW:
        say(f"{len(first)} tests have failed: none is run again")
        return 1
    options = ["--last-failed", "--last-failed-no-failures", "none", "-o", f"cache_dir={cache}"]
    done = subprocess.run([sys.executable, "-m", "pytest", *options, *words], check=False, timeout=LIMIT_S)
    for name in sorted(first):
        say(f"failed {'twice' if name in failed(cache) else 'once, passed when run again'}: {name}")
    return done.returncode


def say(text: str) -> None:
    """A line for whoever reads the log."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(again(Path(sys.argv[1]).resolve(), sys.argv[2:]))
