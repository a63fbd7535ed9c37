"""The reports of a test's processes as JSON lines, for a program that has started the test."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping, Sequence
from typing import Any, TextIO

from common.terminal.printable import behind

ALIVE_S = 0.5  # between two lists of the processes that run: a reader may call a list of two seconds stale


class ForwardedProgress:
    """Writes one object per line on standard error; a reader that has gone does not end the test."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = behind(stream or sys.stderr)
        self._listed = -ALIVE_S

    def forward(self, process: str, data: Mapping[str, Any]) -> None:
        """A report of a process, as it was made."""
        self._put({"process": process, **data})

    def say(self, text: str) -> None:
        """A line for the user."""
        self._put({"kind": "text", "text": text})

    def alive(self, processes: Sequence[str]) -> None:
        """The processes that run, every `ALIVE_S`."""
        if time.monotonic() - self._listed >= ALIVE_S:
            self._listed = time.monotonic()
            self._put({"kind": "alive", "processes": list(processes)})

    def end(self) -> None:
        """Nothing more comes."""

    def _put(self, data: Mapping[str, Any]) -> None:
        try:
            self._stream.write(json.dumps(data) + "\n")
            self._stream.flush()
        except OSError:
            pass
