"""`python -m tests.system.faults.slow_recorder …`: the recorder on a disk that stalls for 300 ms in every second."""

from __future__ import annotations

import sys
import time
from typing import Any

from common.lab import process
from recorder.__main__ import add_arguments, run
from recorder.sink import FileSink

STALL, EVERY = 0.3, 1.0  # s


def slow_down() -> None:
    """Every second one write of the file takes long."""
    put = FileSink.put
    stalled = [time.monotonic()]

    def slow(self: FileSink, items: list[Any]) -> None:
        if time.monotonic() - stalled[0] >= EVERY:
            time.sleep(STALL)
            stalled[0] = time.monotonic()
        put(self, items)

    FileSink.put = slow  # type: ignore[method-assign]


if __name__ == "__main__":
    slow_down()
    sys.exit(process.enter("recorder", __doc__, add_arguments, run))
