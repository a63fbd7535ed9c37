"""Where the time of each tick went: stamps of both laboratories put together on the master's clock."""

from __future__ import annotations

import math
from typing import NamedTuple

from common.clock_offset import ClockOffset
from common.laboratory import Laboratory
from common.messages import Feedback

NAN = math.nan


class Opened(NamedTuple):
    """What the master knows of a tick when its command is out; `sent_ns` 0 where none went out."""

    tick: int
    wake_ns: int
    sent_ns: int


class Answered(NamedTuple):
    """The feedback to a tick, and when it came."""

    feedback: Feedback
    received_ns: int


class Account:
    """Latency of the ticks; a tick's row is written when the next tick begins."""

    def __init__(self, lab: Laboratory, offset: ClockOffset) -> None:
        self._lab = lab
        self._offset = offset
        self._opened: Opened | None = None
        self._answered: Answered | None = None
        self.sync_sent_ns = 0
        self.first_offset = 0
        self.missed = 0
        self.round_trip = NAN

    def open(self, tick: int, wake_ns: int, sent_ns: int) -> None:
        """The tick's command is out."""
        self._opened = Opened(tick, wake_ns, sent_ns)

    def answer(self, feedback: Feedback, received_ns: int) -> None:
        """A feedback came."""
        self._answered = Answered(feedback, received_ns)
        opened = self._opened
        if opened is not None and opened.tick == feedback.seq == feedback.command_seq:
            self._offset.add(opened.sent_ns, feedback.command_received_ns, feedback.sent_ns, received_ns)

    def close(self, tick: int, used_ns: int) -> None:
        """The next tick begins: write the row of `tick`."""
        opened, answered = self._opened, self._answered
        if opened is None or opened.tick != tick:
            return
        lab = self._lab
        complete = answered is not None and answered.feedback.seq == answered.feedback.command_seq == tick
        missed = opened.sent_ns == 0 or not complete
        self.missed += missed
        if answered is not None and complete:
            self.round_trip = (answered.received_ns - opened.sent_ns) * 1e-9
        if lab.recorder is None:
            return
        segments, stamps = self._segments(opened, answered if complete else None)
        at = lab.tick_ns(tick)
        values = (
            tick,
            (opened.wake_ns - at) * 1e-9,
            (opened.sent_ns - opened.wake_ns) * 1e-9 if opened.sent_ns else NAN,
            *segments,
            self._offset.offset * 1e-9,
            self._offset.bound * 1e-9,
            missed,
            at,
            opened.wake_ns,
            opened.sent_ns,
            *stamps,
            used_ns,
        )
        log_ns = lab.epoch_ns + tick * lab.interval_ns
        lab.outlet.add("latency", log_ns, lab.epoch_ns + used_ns - lab.start_ns, values)

    def _segments(
        self, opened: Opened, answered: Answered | None
    ) -> tuple[tuple[float, float, float, float], tuple[int, int, int]]:
        if answered is None:
            return (NAN, NAN, NAN, NAN), (0, 0, 0)
        feedback, received_ns = answered
        offset = self._offset.offset
        segments = (
            (feedback.command_received_ns - offset - opened.sent_ns) * 1e-9,
            (feedback.sent_ns - feedback.command_received_ns) * 1e-9,
            (received_ns - feedback.sent_ns + offset) * 1e-9,
            (received_ns - opened.sent_ns) * 1e-9,
        )
        return segments, (feedback.command_received_ns, feedback.sent_ns, received_ns)

    def progress(self) -> dict[str, float]:
        """Newest round trip (s) and the count of missed deadlines."""
        return {"round_trip": self.round_trip, "missed": float(self.missed)}
