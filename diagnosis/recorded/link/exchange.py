"""The exchange between the laboratories, from the numbers and time stamps of the messages, never from waveforms.

The number of the message that a tick used gives the message's age. Time stamps give the time that each message took,
and which feedback never came:

    command k is first in force at the slave's tick m  →  feedback m answers it  →  row k of the latency topic
    holds the stamps of that feedback; where it holds none, feedback m was lost

Ticks at which a laboratory was late itself, with those around them, are a matter of scheduling and are not counted. A
message number that is never used shows a loss only where no message overtakes another, that is in virtual time when all
take equally long. Without time stamps only the ages are left (see `ages`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.recording.run import Run
from diagnosis.recorded.record import laid_out, without_rows
from diagnosis.signals.mask import Mask
from loop.closed_loop import MessagesUsed
from models.registry import Array

Index = NDArray[np.int64]
Interval = tuple[float, float]

# Lateness of a wake-up over the interval from which on a tick is not counted: the process was late itself, or it waited
# for a message until its deadline. On time a process wakes within some 50 µs of 2 ms.
LATE = 0.15
# Ticks after a late one that are not counted either: messages of up to three ticks before may be in use then.
SPOILT = 3
# Share of messages of one age from which on they count as equally old on a real clock, where a few wake-ups are late.
STEADY = 0.98
LEAST_STAMPS = 20  # fewest one-way times from which jitter is judged: their rms is then known within 16 %
TINY = 1e-6  # s, scatter below which one-way times in virtual time are equal: they are computed to the nanosecond
CERTAIN = 1000.0  # largest number of standard deviations that is stated
EDGE = 5  # last ticks of a test, whose answers may not have arrived before its end


class Direction(NamedTuple):
    """The messages of one direction."""

    ages: Index  # ticks more than in an ideal exchange, at the ticks that count
    fresh: Index  # the same, of messages used for the first time
    tried: Index  # numbers of the messages of which it is known whether they arrived
    lost: Mask  # which of these did not
    one_way: Array  # s, of messages whose time stamps are known
    selected: bool  # whether only those are known that were not overtaken
    overtaken: int  # messages that arrived after a later one, according to the time stamps

    @property
    def old_share(self) -> float:
        """Share of ticks that used a message older than in an ideal exchange."""
        return float(np.mean(self.ages > 0)) if self.ages.size else 0.0

    @property
    def usual(self) -> int:
        """The commonest age of a message at its first use, ticks."""
        return int(np.bincount(np.clip(self.fresh, 0, None)).argmax()) if self.fresh.size else 0

    @property
    def steady(self) -> float:
        """Share of messages that had the usual age."""
        return float(np.mean(self.fresh == self.usual)) if self.fresh.size else 1.0


class LinkAccount(NamedTuple):
    """Both directions, and how the ticks were paced."""

    command: Direction | None
    feedback: Direction | None
    virtual: bool  # virtual time, in which no tick is late
    stamped: bool  # whether one-way times are known
    bound: float  # s, largest error of the clocks' offset
    late: int  # ticks at which a laboratory or the wire was late: scheduling, which is no effect of the link

    @property
    def directions(self) -> list[Direction]:
        """The directions that were recorded."""
        return [item for item in (self.command, self.feedback) if item is not None]


class LinkFinding(NamedTuple):
    """An effect of the link with its parameters, each with an interval."""

    effect: str
    parameters: dict[str, tuple[float, Interval]]
    evidence: str
    z: float  # standard deviations above what the plan's link would show


class Ticks(NamedTuple):
    """The recorded topics on the ticks, as the account needs them."""

    command: Index  # in force at the slave's tick
    has_slave: Mask
    feedback: Index  # used at the master's tick
    has_master: Mask
    rows: dict[str, Array]  # of the latency topic, empty without it
    has_rows: Mask


def account(run: Run, interval: float) -> LinkAccount:
    """The account of a recording's messages; ticks at which a laboratory was late itself are left out of it."""
    ticks = laid(run, interval)
    virtual = on_a_virtual_clock(ticks)
    stamped = int(np.isfinite(ticks.rows.get("round_trip", np.zeros(0))).sum()) >= LEAST_STAMPS
    late = late_ticks(ticks, interval)
    good = ~spread(late, SPOILT)
    command = feedback = None
    if ticks.has_slave.any():
        command = direction(ticks.command, ticks.has_slave & good, 0, exact=virtual)
        command = commands(command, ticks, good, virtual=virtual) if stamped else command
    if ticks.has_master.any():
        feedback = direction(ticks.feedback, ticks.has_master & good, 1, exact=virtual)
        feedback = feedbacks(feedback, ticks, good, virtual=virtual) if stamped else feedback
    bounds = ticks.rows.get("clock_offset_bound", np.zeros(1))
    return LinkAccount(command, feedback, virtual, stamped, float(np.nanmax(bounds)), int(late.sum()))


def commands(item: Direction, ticks: Ticks, good: Mask, *, virtual: bool) -> Direction:
    """The commands with their one-way times; on a real clock an unused command may have come late, which is no loss."""
    known = times(ticks, "command_one_way", good)
    item = item._replace(one_way=known, selected=scatters(known))
    return item if virtual and not item.selected else item._replace(tried=item.tried[:0], lost=item.lost[:0])


def feedbacks(item: Direction, ticks: Ticks, good: Mask, *, virtual: bool) -> Direction:
    """The feedbacks with their one-way times; answers show which were lost where the ages do not."""
    item = item._replace(one_way=times(ticks, "feedback_one_way", good), overtaken=overtaken(ticks))
    if virtual and item.tried.size and not scatters(item.one_way):
        return item
    tried, lost = answers(ticks, good)
    return item._replace(tried=tried, lost=lost)


def laid(run: Run, interval: float) -> Ticks:
    """The topics on the ticks; missing values are −1 or NaN. An import's missing rows are no lost messages."""
    size = 1 + max((int(values.max()) for values in run.sequences.values() if values.size), default=0)
    unknown = without_rows(run, interval, size)

    def column(topic: str, name: str) -> tuple[Array, Mask]:
        values, there = np.full(size, np.nan), np.zeros(size, dtype=bool)
        if run.has(topic) and name in run.columns[topic]:
            places = run.sequences[topic]
            values[places] = run.columns[topic][name]
            there[places] = True
        return values, there & ~unknown

    command, has_slave = column("slave", "command_seq")
    feedback, has_master = column("master", answered(run))
    names = run.columns.get("latency", {}) if run.has("latency") else {}
    rows = {name: column("latency", name)[0] for name in names}
    whole = [np.where(np.isfinite(item), item, -1.0).astype(np.int64) for item in (command, feedback)]
    has_rows = np.zeros(size, dtype=bool)
    has_rows[run.sequences["latency"] if rows else []] = True
    return Ticks(whole[0], has_slave, whole[1], has_master, rows, has_rows)


def answered(run: Run) -> str:
    """The master's signal with the tick at which the slave measured the force in use; empty where not recorded."""
    names = (name for name in run.columns.get("master", {}) if name.endswith("_seq"))
    return next((name for name in names if name != "seq"), "")


def on_a_virtual_clock(ticks: Ticks) -> bool:
    """Whether every tick was exactly at its nominal time."""
    lateness = ticks.rows.get("wake_lateness")
    return lateness is not None and not np.any(np.nan_to_num(lateness))


def late_ticks(ticks: Ticks, interval: float) -> Mask:
    """Ticks that the master did not command, and those at which it woke late unless it did so at most ticks.

    The master waits for a message that is late on the wire, so that it wakes late; as long as that is an exception, it
    is a matter of scheduling. A delay or loss that a plug-in adds does not happen on the wire and is not waited for.
    """
    held = ticks.rows.get("command_sent_ns", np.ones(ticks.command.size)) == 0
    woke = ticks.rows.get("wake_lateness", np.zeros(held.size)) > LATE * interval
    return held | woke if woke.mean() < 0.5 else held


def spread(late: Mask, after: int) -> Mask:
    """The ticks of a mask, the one before and some after each."""
    return np.convolve(late, np.ones(after + 2), "full")[1 : late.size + 1] > 0


def direction(used: Index, there: Mask, nominal: int, *, exact: bool) -> Direction:
    """Ages of one direction and, where all its messages are equally old, which of them never arrived."""
    ages = np.arange(used.size) - nominal - used
    first = np.diff(used, prepend=-1) > 0
    counted = there & (used >= 0)
    result = Direction(
        ages[counted],
        ages[counted & first],
        np.zeros(0, dtype=np.int64),
        np.zeros(0, dtype=bool),
        np.zeros(0),
        False,
        0,
    )
    if result.steady < (1.0 if exact else STEADY):
        return result
    due = np.flatnonzero(there & (np.arange(used.size) >= nominal + result.usual))
    return result._replace(tried=due - nominal - result.usual, lost=ages[due] != result.usual)


def times(ticks: Ticks, name: str, good: Mask) -> Array:
    """One-way times that are known, s."""
    values = ticks.rows[name][good]
    return values[np.isfinite(values)]


def first_uses(ticks: Ticks) -> Index:
    """The slave's ticks at which a command was certainly in force for the first time."""
    before = np.concatenate([[True], ticks.has_slave[:-1]])
    first = (np.diff(ticks.command, prepend=-1) > 0) & ticks.has_slave & before
    return np.flatnonzero(first[:-EDGE])


def answers(ticks: Ticks, good: Mask) -> tuple[Index, Mask]:
    """Feedbacks that were the first to answer a command, and which of them never arrived."""
    tried = first_uses(ticks)
    tried = tried[ticks.has_rows[ticks.command[tried]] & good[tried]]
    return tried, ~np.isfinite(ticks.rows["round_trip"][ticks.command[tried]])


def scatters(times: Array) -> bool:
    """Whether messages take different times, so that one may overtake another."""
    return times.size > 0 and float(np.ptp(times)) > TINY


def overtaken(ticks: Ticks) -> int:
    """How many feedbacks arrived after a later one."""
    came = ticks.rows.get("feedback_received_ns", np.zeros(0))
    came = came[np.isfinite(came) & (came > 0)]
    return int(np.sum(came[:-1] > np.minimum.accumulate(came[::-1])[::-1][1:]))


def certainty(value: float, deviation: float) -> float:
    """A value in its standard deviations, `CERTAIN` at most."""
    return min(value / deviation, CERTAIN) if deviation > 0.0 else CERTAIN


def exchange_of(run: Run, ticks: int, interval: float) -> MessagesUsed:
    """Which message each tick used, as recorded; where a tick is missing, the one before serves on.

    Where an import has no rows messages are as old as before.
    """
    result, apart = [], without_rows(run, interval, ticks)
    for topic, name in (("slave", "command_seq"), ("master", answered(run))):
        values, there = laid_out(run.columns[topic][name].astype(np.float64), run.sequences[topic], ticks)
        known = np.where(there.cumsum() > 0, values, -1.0).astype(np.int64)
        if apart.any():
            last = np.maximum.accumulate(np.where(apart, 0, np.arange(ticks)))
            known = known[last] + np.arange(ticks) - last
        result.append(np.minimum(known, np.arange(ticks)))
    return MessagesUsed(*result)
