"""The bodies of the processes of a test in virtual time: those of the laboratories, and that of the recorder."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import cast

from common.host.realtime import NOTHING
from common.host.stopping import Stopper
from common.lab.drive import DrivenLoop, drive
from common.lab.preflight import Gate
from common.lab.surroundings import Surroundings
from common.link.endpoint import Endpoint
from common.recording.writer import Recording
from recorder.__main__ import receive
from recorder.loop import RecorderLoop
from simulation.world import Process

NOTHING_REJECTED: Mapping[str, int] = {}


class VirtualSurroundings(Surroundings):
    """Virtual time has no machine to watch; only the results of the pre-flight are recorded."""

    def begin(self) -> None:
        """Record the results of the pre-flight; called before the first tick."""
        self._gate.note(self._lab)


def driving(
    loop: DrivenLoop,
    stopping: Callable[[], str],
    gate: Gate | None = None,
    rejected: Mapping[str, int] = NOTHING_REJECTED,
) -> Callable[[], None]:
    """The body of a laboratory's process; `rejected` counts the frames that its endpoint rejects, by reason."""

    def body() -> None:
        loop.lab.heard_ns = loop.lab.clock.now()
        surroundings = VirtualSurroundings(loop.lab, NOTHING, rejected, timed=False, gate=gate)
        drive(loop, stopping, surroundings)

    return body


def recording(
    loop: RecorderLoop, endpoint: Endpoint, process: Process, file: Recording
) -> Callable[[], None]:
    """The body of the recorder's process; if it is killed, data not yet written to the file are lost."""
    stopping = cast("Stopper", process.stopping)  # `receive` only calls it

    def body() -> None:
        try:
            receive(loop, endpoint, stopping)
        finally:
            if process.killed:
                file.abandon()
            else:
                loop.close()

    return body
