"""The latency of each tick: time stamps of master and slave combined on the master's clock.

The row of a tick follows its command: to the slave, into force there at once or some ticks later, and back with the
first feedback that names it. The row is written when that feedback is there, at the earliest when the next tick begins,
or when a feedback names a later command: then this one was lost, overtaken or never sent, its segments are NaN and its
stamps 0. A delay of a link plug-in is included in the stamps, as if the network were that slow; the offset of the
clocks is estimated without it, from the command that the slave received last and the time when it did.
"""

from __future__ import annotations

import math
from collections import deque

from common.host.clock_offset import ClockOffset
from common.lab.laboratory import Laboratory
from common.link.mailbox import ticks_late
from common.protocol.messages import Feedback

NAN = math.nan

Answered = tuple[float, float, float, float, float, float, int, int, int, int]


class LatencyRow:
    """The master's stamps of a tick; `sent_ns` is 0 if no command was sent, `used_ns` is 0 until the next tick."""

    __slots__ = (
        "age",
        "decoded_ns",
        "extra",
        "feedback",
        "missed",
        "ready_ns",
        "received_ns",
        "sent_ns",
        "tick",
        "used_ns",
        "wake_ns",
    )

    def __init__(self, tick: int, wake_ns: int, ready_ns: int, sent_ns: int, age: float) -> None:
        self.tick = tick
        self.wake_ns = wake_ns
        self.ready_ns = ready_ns  # when the command's values were computed
        self.sent_ns = sent_ns  # when its frame was handed to the link
        self.age = age  # s, of the feedback that the tick used
        self.used_ns = 0
        self.missed = False
        self.feedback: Feedback | None = None
        self.received_ns = 0
        self.decoded_ns = 0  # when the feedback was decoded
        self.extra = 0.0  # s, delay of the feedback by a link plug-in


class LatencyAccount:
    """Writes the latency of the exchange with one slave, one row per tick in order, into a topic of its own."""

    def __init__(self, lab: Laboratory, offset: ClockOffset, topic: str) -> None:
        self._lab = lab
        self._topic = topic
        self._offset = offset
        self._rows: dict[int, LatencyRow] = {}
        self._on_the_way: deque[tuple[int, int]] = (
            deque()
        )  # commands not received by the slave yet: tick, sent_ns
        self._named = -1  # newest command that a feedback has named
        self.missed = 0
        self._prompt = (
            -1
        )  # newest feedback that came after its tick's command had been received, without plug-ins
        self.late_last = False  # whether the last tick was late, without the delay of plug-ins
        self.round_trip = NAN

    def open(self, tick: int, wake_ns: int, ready_ns: int, sent_ns: int, used: Feedback) -> None:
        """Open the row of a tick whose command was sent; stamps in ns, that of the command 0 where none was sent."""
        age = (wake_ns + self._offset.at(wake_ns) - used.started_ns) * 1e-9 if used.seq >= 0 else NAN
        self._rows[tick] = LatencyRow(tick, wake_ns, ready_ns, sent_ns, age)
        if sent_ns:
            self._on_the_way.append((tick, sent_ns))

    def answer(self, feedback: Feedback, received_ns: int, decoded_ns: int, extra: float | None) -> None:
        """Take a feedback, which a link plug-in delays by `extra` (s), or loses where it is None."""
        self._compare_clocks(feedback, received_ns)
        named, seq = feedback.command_seq, feedback.seq
        self._named = named if named > self._named else self._named
        if feedback.heard_seq >= seq > self._prompt:
            self._prompt = seq
        row = self._rows.get(named)
        if row is None or not feedback.command_received_ns or extra is None:
            return
        row.feedback, row.extra = feedback, extra
        delayed_ns = round(extra * 1e9) if extra else 0
        row.received_ns = received_ns + delayed_ns
        row.decoded_ns = decoded_ns + delayed_ns
        self.round_trip = (row.received_ns - row.sent_ns) * 1e-9

    def _compare_clocks(self, feedback: Feedback, received_ns: int) -> None:
        """Add an exchange of stamps for the command that the slave has received last."""
        on_the_way, heard = self._on_the_way, feedback.heard_seq
        while on_the_way and on_the_way[0][0] <= heard:
            tick, sent_ns = on_the_way.popleft()
            if tick == heard:
                self._offset.add(sent_ns, feedback.heard_ns, feedback.sent_ns, received_ns)

    def close(self, tick: int, used_ns: int) -> None:
        """Judge `tick` when the next one begins, and write the rows that are complete."""
        row = self._rows.get(tick)
        if row is not None and not row.used_ns:
            row.used_ns = used_ns
            late = row.sent_ns == 0 or row.wake_ns >= self._lab.tick_ns(tick + 1)
            row.missed = late or not self._in_time(row)
            self.missed += row.missed
            self.late_last = late or self._prompt < tick
        self._write(used_ns, everything=False)

    def finish(self, tick: int, used_ns: int) -> None:
        """Write all rows, because `tick` was the last."""
        self.close(tick, used_ns)
        self._write(used_ns, everything=True)

    def _in_time(self, row: LatencyRow) -> bool:
        """Whether the tick's own feedback answered its command and arrived before the next tick."""
        if row.feedback is None or row.feedback.seq != row.tick:
            return False
        return row.extra == 0.0 or ticks_late(row.extra, self._lab.plan.test.interval) == 0

    def _write(self, now: int, *, everything: bool) -> None:
        """Write the rows of past ticks in order, up to the first row that a later feedback may still complete."""
        rows = self._rows
        for tick in tuple(rows):
            row = rows[tick]
            known = row.feedback is not None or row.sent_ns == 0 or tick < self._named
            if not row.used_ns or not (known or everything):
                return
            del rows[tick]
            if self._lab.recorded:
                self._record(row, now)

    def _record(self, row: LatencyRow, now: int) -> None:
        lab, tick, wake, ready, sent = self._lab, row.tick, row.wake_ns, row.ready_ns, row.sent_ns
        at, offset = lab.tick_ns(tick), self._offset.at(wake)
        there, in_slave, computing, back, round_trip, decoding, received, started, replied, returned = (
            UNANSWERED if row.feedback is None else answered(row, row.feedback, offset)
        )
        values = (
            lab.unix_ns(tick),
            lab.epoch_ns + now - lab.start_ns,
            tick,
            (wake - at) * 1e-9,
            (ready - wake) * 1e-9 if sent else NAN,
            there,
            in_slave,
            back,
            round_trip,
            offset * 1e-9,
            self._offset.bound_at(wake) * 1e-9,
            row.missed,
            (sent - ready) * 1e-9 if sent else NAN,
            computing,
            decoding,
            row.age,
            at,
            wake,
            sent,
            received,
            started,
            replied,
            returned,
            row.used_ns,
        )
        lab.outlet.add(self._topic, values)


# six segments (s) and four stamps (ns) of a tick that no feedback answers, in the order of `answered`
UNANSWERED: Answered = (NAN, NAN, NAN, NAN, NAN, NAN, 0, 0, 0, 0)


def answered(row: LatencyRow, feedback: Feedback, offset: int) -> Answered:
    """The segments (s) of a tick that a feedback answers, and its stamps (ns) as they were read.

    The segments are command one way, time in the slave, computation in it, feedback one way, round trip, decoding. The
    stamps are command received, slave started, feedback sent, received. `offset` (ns) is slave clock minus master
    clock.
    """
    received, started, replied = feedback.command_received_ns, feedback.started_ns, feedback.sent_ns
    sent, returned = row.sent_ns, row.received_ns
    return (
        (received - offset - sent) * 1e-9,
        (replied - received) * 1e-9,
        (replied - started) * 1e-9,
        (returned - replied + offset) * 1e-9,
        (returned - sent) * 1e-9,
        (row.decoded_ns - returned) * 1e-9,
        received,
        started,
        replied,
        returned,
    )
