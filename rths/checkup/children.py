"""The processes that a check starts: the terminal's signals do not reach them, and they always end with the check."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from common.host import realtime
from common.host.bare_loop import BareLoop

ROOT = Path(__file__).resolve().parents[2]
# s, beyond the time of the measurement: both processes import numpy and zenoh first, which takes a second on an idle
# machine and many on a loaded one, and they find each other within `exchange.PATIENCE`.
GRACE = 45.0
LOOK = 0.05  # s, between two looks whether a process has ended: the processor stays free for the measurement


@contextlib.contextmanager
def child(*words: str) -> Iterator[subprocess.Popen[str]]:
    """A process of the exchange, which is killed at the end of the context."""
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "rths.checkup.exchange", *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout, process.stderr):
            if pipe is not None:
                pipe.close()


def exchange(interval_ns: int, length: float, mode: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Let two processes exchange frames for `length` s, once both are up; what the master was granted and measured.

    `error` in the latter says why it measured nothing.
    """
    from common.link.zenoh_link import listenable

    endpoint = listenable()
    words = [endpoint, "--rt", mode, "--interval-ns", str(interval_ns), "--length", str(length)]
    processors = [None, None] if mode == "off" else realtime.assign(2)
    places = [[] if processor is None else ["--processor", str(processor)] for processor in processors]
    with (
        child("master", *words, *places[0]) as master,
        child("slave", *words, *places[1]) as slave,
        contextlib.suppress(subprocess.TimeoutExpired, ValueError),
    ):
        # Not `communicate`, which would end the child's standard input; its few lines fit into the pipes.
        ended = first_ended((master, slave), length + GRACE)
        master.kill()  # where the slave has failed, there would be no answer
        said = master.stdout.read() if master.stdout else ""
        complaint = ended.stderr.read() if ended.stderr else ""
        granted, *found = map(json.loads, said.splitlines()) if said else [{}]
        if found:
            return granted, found[0]
        reason = complaint.strip().splitlines()[-1:] or ["it ended without a message"]
        return granted, {"error": reason[0].removeprefix("rths: ")}
    return {}, {
        "error": f"the exchange did not end within {length + GRACE:.0f} s: end other programs, and repeat"
    }


def first_ended(processes: Sequence[subprocess.Popen[str]], timeout: float) -> subprocess.Popen[str]:
    """The process that ends first.

    Raises:
        TimeoutExpired: none has ended within `timeout` s.
    """
    deadline = time.monotonic() + timeout
    while time.monotonic() < deadline:
        for process in processes:
            if process.poll() is not None:
                return process
        time.sleep(LOOK)
    raise subprocess.TimeoutExpired(processes[0].args, timeout)


def wake_ups(interval_ns: int, length: float, priority: int, processor: int) -> dict[str, dict[str, float]]:
    """Bare loops for `length` s: an ordinary one, and one at the real-time priority where that is above 0.

    They run side by side, so that both see the same interruptions by the host.
    """
    loops = {"ordinary": BareLoop()}
    try:
        loops["ordinary"].spawn(interval_ns, 0, -1)
        if priority:
            loops["fifo"] = BareLoop()
            loops["fifo"].spawn(interval_ns, priority, processor)
        time.sleep(length)
    finally:
        found = {name: loop.stop() for name, loop in loops.items()}
    return found
