"""Where the time of each tick went: stamps of both laboratories put together on the master's clock.

The row of a tick follows its command: to the slave, in force there at once or some ticks later, and back with the
first feedback that names it. The row is written when that feedback is there, at best as the next tick begins, or when
a feedback names a later command: then this one was lost, overtaken or never sent, and its segments are NaN,
its stamps 0. A delay of a link plug-in is part of the stamps, as if the network were that slow; the clocks'
offset is estimated without it, by exchanges that were not delayed at all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from common.clock_offset import ClockOffset
from common.laboratory import Laboratory
from common.mailbox import ticks_late
from common.messages import Feedback

NAN = math.nan


@dataclass
class Row:
    """What the master knows of a tick; `sent_ns` 0 where no command went out, `used_ns` 0 while it lasts."""

    tick: int
    wake_ns: int
    sent_ns: int
    used_ns: int = 0
    missed: bool = False
    feedback: Feedback | None = None
    received_ns: int = 0
    extra: float = 0.0  # s, of a link plug-in on the feedback


class Account:
    """Latency of the ticks, one row each, in order."""

    def __init__(self, lab: Laboratory, offset: ClockOffset) -> None:
        self._lab = lab
        self._offset = offset
        self._rows: dict[int, Row] = {}
        self._named = -1  # newest command that a feedback has named
        self.sync_sent_ns = 0
        self.first_offset = 0
        self.missed = 0
        self.round_trip = NAN

    def open(self, tick: int, wake_ns: int, sent_ns: int) -> None:
        """The tick's command is out."""
        self._rows[tick] = Row(tick, wake_ns, sent_ns)

    def answer(self, feedback: Feedback, received_ns: int, extra: float | None) -> None:
        """A feedback came, delayed by a link plug-in where `extra` (s) is positive, lost by it where None."""
        self._named = max(self._named, feedback.command_seq)
        row = self._rows.get(feedback.command_seq)
        if row is None or not feedback.command_received_ns:
            return
        if feedback.seq == row.tick:  # a command in force at its own tick was not delayed by a plug-in
            self._offset.add(row.sent_ns, feedback.command_received_ns, feedback.sent_ns, received_ns)
        if extra is None:
            return
        row.feedback, row.extra = feedback, extra
        row.received_ns = received_ns + round(extra * 1e9)
        self.round_trip = (row.received_ns - row.sent_ns) * 1e-9

    def close(self, tick: int, used_ns: int) -> None:
        """The next tick begins: judge `tick`, and write what is complete."""
        row = self._rows.get(tick)
        if row is not None and not row.used_ns:
            row.used_ns = used_ns
            row.missed = row.sent_ns == 0 or not self._in_time(row)
            self.missed += row.missed
        self._write(used_ns, everything=False)

    def finish(self, tick: int, used_ns: int) -> None:
        """`tick` was the last: write all."""
        self.close(tick, used_ns)
        self._write(used_ns, everything=True)

    def _in_time(self, row: Row) -> bool:
        """Whether the feedback of the tick itself answers it and is there for the next."""
        if row.feedback is None or row.feedback.seq != row.tick:
            return False
        return ticks_late(row.extra, self._lab.plan.test.interval) == 0

    def _write(self, now: int, *, everything: bool) -> None:
        """Rows of ticks that are over, from the oldest to the first of which more will be known."""
        while self._rows:
            row = next(iter(self._rows.values()))
            known = row.feedback is not None or row.sent_ns == 0 or row.tick < self._named
            if not row.used_ns or not (known or everything):
                return
            del self._rows[row.tick]
            if self._lab.recorder is not None:
                self._record(row, now)

    def _record(self, row: Row, now: int) -> None:
        lab = self._lab
        segments, stamps = self._segments(row)
        at = lab.tick_ns(row.tick)
        values = (
            row.tick,
            (row.wake_ns - at) * 1e-9,
            (row.sent_ns - row.wake_ns) * 1e-9 if row.sent_ns else NAN,
            *segments,
            self._offset.offset * 1e-9,
            self._offset.bound * 1e-9,
            row.missed,
            at,
            row.wake_ns,
            row.sent_ns,
            *stamps,
            row.used_ns,
        )
        log_ns = lab.epoch_ns + row.tick * lab.interval_ns
        lab.outlet.add("latency", log_ns, lab.epoch_ns + now - lab.start_ns, values)

    def _segments(self, row: Row) -> tuple[tuple[float, float, float, float], tuple[int, int, int]]:
        feedback = row.feedback
        if feedback is None:
            return (NAN, NAN, NAN, NAN), (0, 0, 0)
        offset = self._offset.offset
        segments = (
            (feedback.command_received_ns - offset - row.sent_ns) * 1e-9,
            (feedback.sent_ns - feedback.command_received_ns) * 1e-9,
            (row.received_ns - feedback.sent_ns + offset) * 1e-9,
            (row.received_ns - row.sent_ns) * 1e-9,
        )
        return segments, (feedback.command_received_ns, feedback.sent_ns, row.received_ns)

    def progress(self) -> dict[str, float]:
        """Newest round trip (s) and the count of missed deadlines."""
        return {"round_trip": self.round_trip, "missed": float(self.missed)}
