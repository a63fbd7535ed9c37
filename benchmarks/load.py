"""Processes that do nothing but compute, to see what a test does beside them."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Iterator

BUSY = 4


@contextlib.contextmanager
def busy(count: int = BUSY) -> Iterator[None]:
    """So many busy processes of ordinary priority, until the end of the block."""
    running = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in running:
            process.kill()
            process.wait()
