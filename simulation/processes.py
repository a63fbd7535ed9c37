"""What the processes of a test do in virtual time: laboratories drive their loops, the recorder takes what is sent."""

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


class Nowhere(Surroundings):
    """No machine that could be watched: what was passed before the start is all there is to tell."""

    def begin(self) -> None:
        """The ticks are about to begin."""
        self._gate.note(self._lab)


def driving(
    loop: DrivenLoop,
    stopping: Callable[[], str],
    gate: Gate | None = None,
    rejected: Mapping[str, int] = NOTHING_REJECTED,
) -> Callable[[], None]:
    """What a laboratory's process does; `rejected` counts the frames that its endpoint rejects."""

    def body() -> None:
        loop.lab.heard_ns = loop.lab.clock.now()
        drive(loop, stopping, Nowhere(loop.lab, NOTHING, rejected, timed=False, gate=gate))

    return body


def recording(
    loop: RecorderLoop, endpoint: Endpoint, process: Process, file: Recording
) -> Callable[[], None]:
    """What the recorder's process does; where it is killed, what it had not handed over is gone."""
    stopping = cast("Stopper", process.stopping)  # all that is asked of one

    def body() -> None:
        try:
            receive(loop, endpoint, stopping)
        finally:
            if process.killed:
                file.abandon()
            else:
                loop.close()

    return body
