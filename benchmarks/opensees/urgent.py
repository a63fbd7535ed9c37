"""Clients of the benchmark as processes, at real-time priority where this process may give it."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence

from benchmarks.whole_test import ROOT
from common.host.realtime import PRIORITY

URGENT = PRIORITY - 1  # of the client, below that of the server
HANG_S = 200.0


def allowed() -> int:
    """The real-time priority that this process may give another one, 0 for none."""
    try:
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(URGENT))
        os.sched_setscheduler(0, *before)
    except (PermissionError, AttributeError):  # no right, or not on this system
        return 0
    return URGENT


def said(words: Sequence[str], priority: int) -> str:
    """The last line of JSON that a client prints, empty where there is none."""
    with subprocess.Popen(
        words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        if priority:
            os.sched_setscheduler(process.pid, os.SCHED_FIFO, os.sched_param(priority))
        text, _ = process.communicate(timeout=HANG_S)
    return next((line for line in reversed(text.splitlines()) if line.startswith("{")), "")
