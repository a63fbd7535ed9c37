"""The exchange between the laboratories, judged by the numbers and stamps of the messages, never by waveforms.

Which message a tick used tells ages; stamps tell how long each message took, and which feedback never came:

    command k first in force at the slave's tick m  →  feedback m is the answer to it  →  row k of the latency
    topic holds that feedback's stamps, or none: then feedback m was lost

Ticks at which a laboratory was late itself, with those around them, are scheduling and do not count. A number that
is never used tells of a loss only where no message overtakes another: in virtual time, all taking equally long.
Without stamps only the ages are left (see `scattered`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import beta

from common.recording.run import Run
from diagnosis.recorded.record import laid_out
from diagnosis.signals.mask import Mask
from loop.closed_loop import MessagesUsed
from models.registry import Array

Index = NDArray[np.int64]
Interval = tuple[float, float]

LATE = (
    0.15  # of an interval: a laboratory that woke later was late, or waited in vain for a message on the wire
)
SPOILT = 3  # ticks after such a tick that say nothing either
STEADY = 0.98  # share of messages of one age from which on, beside a clock, they count as equally old
LEAST_STAMPS = 20
LEAST_LOST = 3  # messages, beside a real clock
LEAST_SHARE = 0.005  # of messages lost where there are no stamps
LEAST_OFF = 0.001  # share of messages off the usual age, without stamps, from which on delays scatter
LEAST_OLD = (
    0.03  # share of old messages where there are no stamps, or of ticks off the usual age beside a real clock
)
TINY = 1e-6  # s, what stamps in virtual time resolve
REAL = 0.1  # of an interval: what stamps of a real clock resolve
EDGE = 5  # last ticks, the answer to which may not have come
SYMMETRIC = 0.5  # skewness below which the constant part of a delay is its mean, not its minimum
CERTAIN = 1000.0  # largest z that is told
WORTH = 10.0  # gain of twice the log-likelihood that a further parameter must bring
DEPENDENT = 2.0  # ages of neighbouring ticks tell of the same messages: intervals are wider by this


class Direction(NamedTuple):
    """The messages of one direction."""

    ages: Index  # ticks beyond the plan's, at the ticks that count
    fresh: Index  # the same, of messages used for the first time
    tried: Index  # numbers of the messages of which it is known whether they came
    lost: Mask  # which of these never did
    one_way: Array  # s, of messages whose stamps tell
    selected: bool  # whether those are only the ones that were not overtaken
    overtaken: int  # messages that came after a later one, as far as stamps tell

    @property
    def old_share(self) -> float:
        """Share of ticks that held a message older than the plan's."""
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
    virtual: bool  # virtual time: nobody was ever late
    stamped: bool  # whether one-way times are known
    bound: float  # s, largest error of the clocks' offset
    late: int  # ticks at which a laboratory was late itself, counted apart
    notes: tuple[str, ...]

    @property
    def directions(self) -> list[Direction]:
        """Those that were recorded."""
        return [item for item in (self.command, self.feedback) if item is not None]


class LinkFinding(NamedTuple):
    """An effect of the link."""

    effect: str
    parameters: dict[str, tuple[float, Interval]]
    evidence: str
    z: float  # standard deviations above what the plan's link would show


class Ticks(NamedTuple):
    """What the account needs, laid out on the ticks."""

    command: Index  # in force at the slave's tick
    has_slave: Mask
    feedback: Index  # used at the master's tick
    has_master: Mask
    rows: dict[str, Array]  # of the latency topic, empty without it
    has_rows: Mask


# -- account --------------------------------------------------------------------------------------


def account(run: Run, interval: float) -> LinkAccount:
    """What a recording says of its messages, ticks apart at which a laboratory was late itself."""
    ticks = laid(run)
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
    count = int(late.sum())
    note = f"{count} ticks at which a laboratory or the wire was late: scheduling, no effect of the link."
    return LinkAccount(
        command, feedback, virtual, stamped, float(np.nanmax(bounds)), count, (note,) if count else ()
    )


def commands(item: Direction, ticks: Ticks, good: Mask, *, virtual: bool) -> Direction:
    """With stamps; beside a real clock a command may be unused because it came late, which is no loss."""
    known = times(ticks, "command_one_way", good)
    item = item._replace(one_way=known, selected=scatters(known))
    return item if virtual and not item.selected else item._replace(tried=item.tried[:0], lost=item.lost[:0])


def feedbacks(item: Direction, ticks: Ticks, good: Mask, *, virtual: bool) -> Direction:
    """With stamps; answers tell losses where the ages do not."""
    item = item._replace(one_way=times(ticks, "feedback_one_way", good), overtaken=overtaken(ticks))
    if virtual and item.tried.size and not scatters(item.one_way):
        return item
    tried, lost = answers(ticks, good)
    return item._replace(tried=tried, lost=lost)


def laid(run: Run) -> Ticks:
    """The topics on the ticks; what is missing is −1 or NaN."""
    size = 1 + max((int(values.max()) for values in run.sequences.values() if values.size), default=0)

    def column(topic: str, name: str) -> tuple[Array, Mask]:
        values, there = np.full(size, np.nan), np.zeros(size, dtype=bool)
        if run.has(topic) and name in run.columns[topic]:
            places = run.sequences[topic]
            values[places] = run.columns[topic][name]
            there[places] = True
        return values, there

    command, has_slave = column("slave", "command_seq")
    feedback, has_master = column("master", answered(run))
    names = run.columns.get("latency", {}) if run.has("latency") else {}
    rows = {name: column("latency", name)[0] for name in names}
    whole = [np.where(np.isfinite(item), item, -1.0).astype(np.int64) for item in (command, feedback)]
    has_rows = np.zeros(size, dtype=bool)
    has_rows[run.sequences["latency"] if rows else []] = True
    return Ticks(whole[0], has_slave, whole[1], has_master, rows, has_rows)


def answered(run: Run) -> str:
    """The master's signal that says when the slave measured the force used; empty where it was not recorded."""
    names = (name for name in run.columns.get("master", {}) if name.endswith("_seq"))
    return next((name for name in names if name != "seq"), "")


def on_a_virtual_clock(ticks: Ticks) -> bool:
    """Whether no tick was off its nominal time at all."""
    lateness = ticks.rows.get("wake_lateness")
    return lateness is not None and not np.any(np.nan_to_num(lateness))


def late_ticks(ticks: Ticks, interval: float) -> Mask:
    """Ticks that the master did not command, and those at which it woke late, unless that is the rule.

    A delay or loss by a plug-in does not happen on the wire, and is not waited for;
    the wire's own lateness is scheduling
    as long as it is an exception.
    """
    held = ticks.rows.get("command_sent_ns", np.ones(ticks.command.size)) == 0
    woke = ticks.rows.get("wake_lateness", np.zeros(held.size)) > LATE * interval
    return held | woke if woke.mean() < 0.5 else held


def spread(late: Mask, after: int) -> Mask:
    """The ticks of a mask, the one before and some after each."""
    return np.convolve(late, np.ones(after + 2), "full")[1 : late.size + 1] > 0


def direction(used: Index, there: Mask, nominal: int, *, exact: bool) -> Direction:
    """Ages of one direction and, where all its messages are equally old, what never came."""
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
    """The slave's ticks at which a command was in force for the first time, and that is certain."""
    before = np.concatenate([[True], ticks.has_slave[:-1]])
    first = (np.diff(ticks.command, prepend=-1) > 0) & ticks.has_slave & before
    return np.flatnonzero(first[:-EDGE])


def answers(ticks: Ticks, good: Mask) -> tuple[Index, Mask]:
    """Feedbacks that answered a command first, and which of them never came."""
    tried = first_uses(ticks)
    tried = tried[ticks.has_rows[ticks.command[tried]] & good[tried]]
    return tried, ~np.isfinite(ticks.rows["round_trip"][ticks.command[tried]])


def scatters(times: Array) -> bool:
    """Whether messages take different times, so that one may overtake another."""
    return times.size > 0 and float(np.ptp(times)) > TINY


def overtaken(ticks: Ticks) -> int:
    """Feedbacks that came after a later one."""
    came = ticks.rows.get("feedback_received_ns", np.zeros(0))
    came = came[np.isfinite(came) & (came > 0)]
    return int(np.sum(came[:-1] > np.minimum.accumulate(came[::-1])[::-1][1:]))


# -- findings -------------------------------------------------------------------------------------


def findings(found: LinkAccount, interval: float) -> list[LinkFinding]:
    """Effects of the link with their parameters and intervals, none where it did what the plan says."""
    if found.stamped and found.feedback is not None:
        result = [delayed(found, interval), jittered(found, interval), lossy(found)]
    elif any(1.0 - item.steady > LEAST_OFF for item in found.directions):
        return scattered(np.concatenate([item.ages for item in found.directions]), interval)
    else:
        result = [aged(found, interval), lossy(found)]
    return [item for item in result if item is not None]


def known(found: LinkAccount) -> list[Array]:
    """One-way times of each direction."""
    return [item.one_way for item in found.directions if item.one_way.size >= LEAST_STAMPS]


def whole(found: LinkAccount) -> list[Array]:
    """The same of directions of which not only the quick messages are known; of any where nothing scatters there."""
    chosen = [item.one_way for item in found.directions if not item.selected and scatters(item.one_way)]
    return chosen or known(found)


def constant(times: Array) -> tuple[float, float]:
    """The part of a delay that all messages have, and its error (two standard deviations), s.

    The least time where the scatter is one-sided; its mean where it is symmetric, as of noise about a delay.
    """
    centred, spread = times - times.mean(), float(times.std())
    if spread > TINY and float(np.mean(centred**3)) < SYMMETRIC * spread**3:
        return float(times.mean()), 2.0 * spread / math.sqrt(times.size)
    return float(times.min()) - spread / times.size, 4.0 * spread / times.size


def delayed(found: LinkAccount, interval: float) -> LinkFinding | None:
    """A constant part of the one-way times that no link of the plan has."""
    parts = [constant(item) for item in known(found)]
    if not parts:
        return None
    value = float(np.mean([part for part, _ in parts]))
    error = max(error for _, error in parts)
    if found.virtual:
        there = value > max(2.5 * error, TINY)
    else:
        quick = min(found.bound, 0.25 * interval)  # a network that the sync exchanges saw as well
        old = max(float(np.median(item.fresh)) if item.fresh.size else 0.0 for item in found.directions)
        there = old >= 1.0 and value - quick > max(2.5 * error, REAL * interval)
        error += found.bound
    if not there:
        return None
    bounds = (
        max(min(part for part, _ in parts) - error, 0.0),
        max(part for part, _ in parts) + error,
    )
    each = " and ".join(f"{1e3 * part:.3f} ms" for part, _ in parts)
    text = f"no message takes less than {each} one way ({', '.join(ways(found))})"
    return LinkFinding("link.delay", {"delay": (value, bounds)}, text, certainty(value, error / 2.0))


def ways(found: LinkAccount) -> list[str]:
    """Each direction's median one-way time, in words."""
    named = (("command", found.command), ("feedback", found.feedback))
    return [
        f"median {name} {1e3 * float(np.median(item.one_way)):.3f} ms"
        for name, item in named
        if item is not None and item.one_way.size
    ]


def jittered(found: LinkAccount, interval: float) -> LinkFinding | None:
    """Scatter of the one-way times."""
    groups = [item - item.mean() for item in whole(found)]
    centred = np.concatenate(groups or [np.zeros(1)])
    value = float(centred.std())
    if found.virtual:
        there = value > TINY
    else:
        low, high = np.percentile(centred, [25.0, 75.0])
        moved = any(item.usual > 0 or 1.0 - item.steady > LEAST_OLD for item in found.directions)
        there = high - low > REAL * interval and moved
    if not there:
        return None
    kurtosis = float(np.mean(centred**4)) / value**4
    error = value * math.sqrt(max(kurtosis - 1.0, 0.1) / (4.0 * centred.size))
    bounds = (max(value - 1.96 * error, 0.0), value + 1.96 * error)
    late = sum(item.overtaken for item in found.directions)
    text = f"one-way times scatter by {1e3 * value:.3f} ms, {late} feedbacks came after a later one"
    return LinkFinding("link.jitter", {"std": (value, bounds)}, text, certainty(value, error))


def aged(found: LinkAccount, interval: float) -> LinkFinding | None:
    """A delay of which only the ticks are known."""
    usual = [item.usual for item in found.directions]
    if not usual or max(usual) == 0:
        return None
    bounds = (max(min(usual) - 1, 0) * interval, max(usual) * interval)
    text = (
        f"messages are used {' and '.join(map(str, usual))} ticks after their own; no stamps tell it closer"
    )
    return LinkFinding("link.delay", {"delay": (sum(bounds) / 2.0, bounds)}, text, CERTAIN)


def lossy(found: LinkAccount) -> LinkFinding | None:
    """Messages that never came, and their runs: a two-state chain."""
    tried = sum(item.tried.size for item in found.directions)
    lost = sum(int(item.lost.sum()) for item in found.directions)
    least = 1 if found.virtual else LEAST_LOST
    if lost < least or (not found.stamped and lost < LEAST_SHARE * tried):
        return None
    followed, ended = np.sum([runs(item) for item in found.directions], axis=0)
    share, leave = lost / tried, max(ended, 0.5) / followed if followed else 1.0
    memory = max(1.0 - leave - leave * share / max(1.0 - share, 1e-9), 0.0)
    heavy = (1.0 - memory) / (1.0 + memory)  # of the messages count as independent
    a, b = lost * heavy + 0.5, (tried - lost) * heavy + 0.5
    low, high = beta.ppf((0.025, 0.975), a, b)
    quick, slow = beta.ppf((0.975, 0.025), ended + 0.5, followed - ended + 0.5)
    values = {
        "probability": (share, (float(min(low, share)), float(max(high, share)))),
        "burst": (
            float(1.0 / leave),
            (float(min(1.0 / quick, 1.0 / leave)), float(max(1.0 / slow, 1.0 / leave))),
        ),
    }
    text = f"{lost} of {tried} messages never came"
    return LinkFinding("link.loss", values, text, certainty(math.sqrt(lost * heavy), 1.0))


def runs(item: Direction) -> tuple[int, int]:
    """Lost messages of which the next one's fate is known, and how many of those came."""
    pairs = item.lost[:-1] & (np.diff(item.tried) == 1)
    return int(pairs.sum()), int(np.sum(pairs & ~item.lost[1:]))


def certainty(value: float, deviation: float) -> float:
    """A value in its standard deviations, as far as is worth telling."""
    return min(value / deviation, CERTAIN) if deviation > 0.0 else CERTAIN


# -- ages alone -----------------------------------------------------------------------------------


class Guess(NamedTuple):
    """A network as the ages alone see it."""

    jitter: float  # s
    delay: float = 0.0  # s
    loss: float = 0.0
    burst: float = 1.0


FREE = {
    "jitter": (0,),
    "delay": (0, 1),
    "loss": (0, 2, 3),
    "all": (0, 1, 2, 3),
}  # places of a guess that are fitted


def scattered(ages: Index, interval: float) -> list[LinkFinding]:
    """Delay, jitter and loss from the ages alone, delay and loss only where they are needed.

    A message is held at the age a where it has come and none of the a newer ones has: lost each, in runs, or not
    come within its j ticks, which has the probability e^(−(j·dt − delay)/jitter).
    """
    counts = np.bincount(np.clip(ages, 0, None)).astype(np.float64) if ages.size else np.zeros(1)
    if counts[1:].sum() <= LEAST_OLD * counts.sum():
        return []
    fits = {name: fitted(counts, interval, places) for name, places in FREE.items()}
    name = min(fits, key=lambda key: fits[key][1] + WORTH * len(FREE[key]))
    best, _, errors = fits[name]
    text = (
        f"the age of messages scatters over {int(np.count_nonzero(counts))} ticks; no stamps tell it closer"
    )

    def told(place: int) -> tuple[float, Interval]:
        value, wide = best[place], math.exp(1.96 * DEPENDENT * min(float(errors[place]), 10.0))
        return value, (value / wide, value * wide)

    found = [LinkFinding("link.jitter", {"std": told(0)}, text, certainty(1.0, DEPENDENT * errors[0]))]
    if 1 in FREE[name]:
        found.append(
            LinkFinding("link.delay", {"delay": told(1)}, text, certainty(1.0, DEPENDENT * errors[1]))
        )
    if 2 in FREE[name]:
        burst, (low, high) = told(3)
        values = {"probability": told(2), "burst": (burst, (max(low, 1.0), high))}
        found.append(LinkFinding("link.loss", values, text, certainty(1.0, DEPENDENT * errors[2])))
    return found


def unlikely(guess: Guess, counts: Array, interval: float) -> float:
    """−2·log-likelihood of the ages' counts."""
    waiting = np.clip(np.arange(counts.size) * interval - guess.delay, 0.0, None)
    late = np.exp(-waiting / guess.jitter).tolist()
    leave = 1.0 / guess.burst
    enter = min(leave * guess.loss / (1.0 - guess.loss), 1.0)
    lost, came, before = guess.loss, 1.0 - guess.loss, 1.0
    shares = []
    for share in late:
        came *= share  # sent, and not there yet
        shares.append(max(before - lost - came, 1e-12))
        before = lost + came
        lost, came = lost * (1.0 - leave) + came * enter, lost * leave + came * (1.0 - enter)
    return -2.0 * float(counts @ np.log(shares))


def fitted(counts: Array, interval: float, places: tuple[int, ...]) -> tuple[Guess, float, Array]:
    """Most likely guess with some places free, −2·log-likelihood, and relative standard deviations."""
    mean = float(counts @ np.arange(counts.size) / counts.sum()) * interval
    start = np.log([max(mean / 2.0, 0.2 * interval), max(mean / 2.0, 0.2 * interval), 0.01, 1.0])

    def guess(x: Array) -> Guess:
        jitter, delay, loss, more = (
            math.exp(min(max(float(x[places.index(place)]), -20.0), 5.0)) if place in places else 0.0
            for place in range(4)
        )
        return Guess(jitter, delay, min(loss, 0.9), 1.0 + more)

    def cost(x: Array) -> float:
        return unlikely(guess(x), counts, interval)

    options = {"xatol": 1e-5, "fatol": 1e-5, "maxiter": 3000, "maxfev": 3000}
    found = minimize(cost, start[list(places)], method="Nelder-Mead", options=options)
    errors = np.zeros(4)
    for place, axis in zip(places, 0.03 * np.eye(len(places)), strict=True):
        bend = (cost(found.x + axis) - 2.0 * found.fun + cost(found.x - axis)) / 0.03**2
        errors[place] = math.sqrt(2.0 / max(bend, 1e-3))
    return guess(found.x), float(found.fun), errors


# -- exchange -------------------------------------------------------------------------------------


def exchange_of(run: Run, ticks: int) -> MessagesUsed:
    """Which message each tick used, as recorded; where a tick is missing, the one before serves on."""
    result = []
    for topic, name in (("slave", "command_seq"), ("master", answered(run))):
        values, there = laid_out(run.columns[topic][name].astype(np.float64), run.sequences[topic], ticks)
        known = np.where(there.cumsum() > 0, values, -1.0).astype(np.int64)
        result.append(np.minimum(known, np.arange(ticks)))
    return MessagesUsed(*result)
