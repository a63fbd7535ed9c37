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


class Account:
    """Latency of the ticks; a tick's row is written when the next tick begins."""

    def __init__(self, lab: Laboratory, offset: ClockOffset) -> None:
        self._lab = lab
        self._offset = offset
        self._opened: Opened | None = None
        self._feedback: Feedback | None = None
        self._received_ns = 0
        self.sync_sent_ns = 0
        self.first_offset = 0
        self.missed = 0
        self.round_trip = NAN

    def open(self, tick: int, wake_ns: int, sent_ns: int) -> None:
        """The tick's command is out."""
        self._opened = Opened(tick, wake_ns, sent_ns)

    def answer(self, feedback: Feedback, received_ns: int) -> None:
        """A feedback came."""
        self._feedback, self._received_ns = feedback, received_ns
        opened = self._opened
        if opened is not None and opened.tick == feedback.seq == feedback.command_seq:
            self._offset.add(opened.sent_ns, feedback.command_received_ns, feedback.sent_ns, received_ns)

    def close(self, tick: int, used_ns: int) -> None:
        """The next tick begins: write the row of `tick`."""
        opened, feedback = self._opened, self._feedback
        if opened is None or opened.tick != tick:
            return
        lab = self._lab
        if feedback is not None and not feedback.seq == feedback.command_seq == tick:
            feedback = None
        missed = opened.sent_ns == 0 or feedback is None
        self.missed += missed
        if feedback is not None:
            self.round_trip = (self._received_ns - opened.sent_ns) * 1e-9
        if lab.recorder is None:
            return
        segments, stamps = self._segments(opened, feedback)
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
        self, opened: Opened, feedback: Feedback | None
    ) -> tuple[tuple[float, float, float, float], tuple[int, int, int]]:
        if feedback is None:
            return (NAN, NAN, NAN, NAN), (0, 0, 0)
        received_ns = self._received_ns
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
