"""Processes that only compute, as a load on the machine beside a test."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Iterator

BUSY = (
    4  # processes: more than the processors that master and slave use, so that every processor is contended
)


@contextlib.contextmanager
def busy(count: int = BUSY) -> Iterator[None]:
    """Run `count` busy processes of ordinary priority until the end of the block."""
    running = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in running:
            process.kill()
            process.wait()
